"""Background, silhouette, projected model image and matching score."""
