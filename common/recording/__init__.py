"""Takes (recordings of a rig in MCAP files): writing, reading and repairing."""
