"""The verdict on takes against the true error: faults, takes with them, fit of the coefficients, tables."""
