"""What the tracker for three to eight cameras reaches: every figure and plot, by one command.  See `__main__`."""
