"""Cameras of Linux (Video4Linux2): which there are, their modes and their controls, by the kernel's own calls."""
