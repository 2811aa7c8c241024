"""Integrator of [Two-view]: roles of the viewers, perspective scaling factors, universal BDP and BAP."""
