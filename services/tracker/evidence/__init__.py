"""Evidence of a frame set on a pose: contour rays, silhouette distances.  [Hybrid V-B]"""
