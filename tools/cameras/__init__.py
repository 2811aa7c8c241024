"""Cameras of this machine and network streams, listed and tried."""
