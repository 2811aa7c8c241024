"""Lags between cameras, found from the silhouettes of a person who moves."""
