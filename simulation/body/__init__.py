"""The body of the simulated person."""
