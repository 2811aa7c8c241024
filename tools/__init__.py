"""Programs that are no process of a rig: command line, recordings, set-up, measurement."""
