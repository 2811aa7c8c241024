"""Integrator: person position, perspective scaling, facade and flank, universal BDP and BAP, and the log."""
