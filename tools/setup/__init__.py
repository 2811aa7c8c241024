"""Set-up of rigs: calibration, cameras, page, synchronization, certificates, checks, models; its steps and their state."""
