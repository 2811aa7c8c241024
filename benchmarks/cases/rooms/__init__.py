"""Silhouettes, poses and advice in rooms that change."""
