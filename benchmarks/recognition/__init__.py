"""Accuracy of posture recognition: from rendered video, from real motion, and in streams."""
