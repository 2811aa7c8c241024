"""Advice of a viewer about its own images."""
