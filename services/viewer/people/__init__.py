"""A small network that finds people and corrects the silhouette, off by default: `people = true` of a viewer."""
