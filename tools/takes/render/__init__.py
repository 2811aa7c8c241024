"""Rendering of a take to a picture or a film, without a screen: the body as shaded solids on a floor."""
