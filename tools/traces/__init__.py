"""`zenocap traces`: the way of an instant from cameras to pose, as OpenTelemetry traces."""
