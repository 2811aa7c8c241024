"""Everything that is not a process of a rig: the command line, recordings, set-up and measurement."""
