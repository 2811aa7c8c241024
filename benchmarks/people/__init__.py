"""Simulated people and the shared clips, tracked and compared with the truth."""
