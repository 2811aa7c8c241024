"""Motion prior: regions of poses, a linear subspace for each, transitions between them.  [Hybrid IV]"""
