"""Set-up: calibration, cameras, page, synchronization, certificates, checks, models, guided steps."""
