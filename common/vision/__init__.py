"""Background models, silhouette extraction, mask codec, cover image and matching score."""
