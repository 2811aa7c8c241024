"""Visual hull: contours, viewing rays and scene points.  [Hybrid III]"""
