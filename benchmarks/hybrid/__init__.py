"""Evaluation of the tracker for three to eight cameras: all figures and plots by one command.  See `__main__`."""
