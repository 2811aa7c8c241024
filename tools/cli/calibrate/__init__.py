"""`zenocap calibrate`: calibrate cameras, and check calibrations."""
