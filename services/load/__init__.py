"""Load: many viewers, rigs and subscribers at given rates, measured until something gives."""
