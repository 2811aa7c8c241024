"""Motions of the simulated person."""
