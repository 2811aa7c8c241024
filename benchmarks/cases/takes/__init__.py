"""Takes: damaged files, killed logs, replay."""
