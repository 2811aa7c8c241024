"""Running a service: loop, clock, settings, logging and recording."""
