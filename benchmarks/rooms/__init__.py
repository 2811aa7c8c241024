"""Silhouettes of simulated people in rooms that change: situations, methods, and their errors."""
