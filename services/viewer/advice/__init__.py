"""Advice of a viewer about its own camera: what is wrong with its images, measured about once a second."""
