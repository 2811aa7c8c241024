"""Cameras of Linux (Video4Linux2): names, modes, controls."""
