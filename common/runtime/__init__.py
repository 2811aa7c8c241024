"""Runtime of a service: loop, clocks, health and logging."""
