"""`zenocap traces`: latency spans of frame sets, from cameras to pose, as OpenTelemetry traces."""
