"""Outputs that send poses to other programs: VMC, VRChat, Foxglove, UDP with JSON lines, LSL, ROS 2."""
