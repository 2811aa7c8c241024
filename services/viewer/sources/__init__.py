"""Where a viewer's frames come from: devices, streams, video files, pictures and the synthetic actor."""
