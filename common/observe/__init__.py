"""The one reader of what the services of a rig publish about themselves."""
