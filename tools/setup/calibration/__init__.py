"""Calibration of cameras, and reports about calibrations."""
