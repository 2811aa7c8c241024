"""What Foxglove and Lichtblick can show of a rig's messages: channels beside our own in the log."""
