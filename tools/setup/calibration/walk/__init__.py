"""Calibration of all cameras from a person who walks about: head, feet and outline of the silhouettes."""
