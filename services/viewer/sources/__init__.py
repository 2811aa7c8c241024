"""Frame sources of a viewer: devices, streams, video files, pictures and the simulated person."""
