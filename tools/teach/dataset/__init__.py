"""Datasets of the simulated person, and the posture models and motion priors trained on them."""
