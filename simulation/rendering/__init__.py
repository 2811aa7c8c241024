"""Rendering of the simulated person by a virtual camera."""
