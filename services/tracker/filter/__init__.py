"""Particle filter: correspondences, refinement, weights.  [Hybrid V]"""
