"""Hybrid tracker: visual hull, learned motion prior, particle filter with refinement.  [Hybrid]"""
