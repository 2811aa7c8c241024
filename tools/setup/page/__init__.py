"""Live page of cameras while a rig is set up: pictures, measures, the printed board."""
