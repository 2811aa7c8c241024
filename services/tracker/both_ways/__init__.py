"""Tracking of a recording in both directions, and the better pose of each section of the body."""
