"""Running a service: loop, clock, settings and logging."""
