"""Integrator: position, perspective, facade and flank, universal BDP and BAP; log."""
