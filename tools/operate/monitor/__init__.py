"""`zenocap top`: a live table of all services of one or more rigs."""
