"""Consistency of the views: wrong calibration, frozen, empty or late cameras."""
