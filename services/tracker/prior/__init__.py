"""The motion prior: regions of poses with a linear subspace each, and transitions between them.  [Hybrid IV]"""
