"""Poses out to the tools that people animate with: VMC, Foxglove, UDP with JSON lines, LSL."""
