"""Channels for the panels of Foxglove and Lichtblick."""
