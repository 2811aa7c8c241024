"""Cameras of this machine, network streams and named sources; and films whose videos are still on their machines."""
