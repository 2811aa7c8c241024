"""`zenocap doctor`: what is wrong with a rig on this machine and its network, and what to do about it."""
