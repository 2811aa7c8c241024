"""Pinhole cameras, level views, calibration files and calibration."""
