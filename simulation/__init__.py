"""Simulated person: a body more detailed than the tracker's, motions, renderer."""
