"""Simulated person: a more detailed body than the tracker's, fifteen postures and other motions, and a renderer."""
