"""A small network that finds people and corrects the silhouette: `people = true`."""
