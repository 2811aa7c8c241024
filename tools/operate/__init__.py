"""Operation: a monitor, metrics, traces, compiled functions, pinned packages."""
