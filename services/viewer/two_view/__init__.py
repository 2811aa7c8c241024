"""Viewer of [Two-view]: body definition, position and joint angles from one silhouette."""
