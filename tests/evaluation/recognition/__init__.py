"""How well postures are recognised: from rendered video, from real motion, and in streams."""
