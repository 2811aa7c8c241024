"""Calibration from a board, from a walk, and the drift check."""
