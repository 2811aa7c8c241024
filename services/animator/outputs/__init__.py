"""Outputs that send poses to other programs: VMC, Foxglove, UDP with JSON lines, LSL."""
