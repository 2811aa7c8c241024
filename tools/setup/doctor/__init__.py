"""`zenocap doctor`: checks of a rig on this machine and its network, with remedies."""
