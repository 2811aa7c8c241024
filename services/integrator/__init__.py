"""Combines the viewers: position, perspective scaling, facade/flank, universal BDP and BAP, and the log."""
