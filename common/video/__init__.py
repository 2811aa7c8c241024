"""Video files: decoding, and the time of every frame."""
