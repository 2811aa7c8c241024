"""One camera, one process: silhouette, body definition, view, position and joint angles."""
