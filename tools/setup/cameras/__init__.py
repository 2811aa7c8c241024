"""Cameras of this machine, network streams, named sources, and films still on other machines."""
