"""A rig: its file, its cameras and viewers, and the table of services that run it."""
