"""Channels for the panels of Foxglove and Lichtblick, in addition to the MessagePack channels of a rig."""
