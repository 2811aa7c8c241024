"""A take: one recording of a rig, written, read and repaired.  A file of it is MCAP."""
