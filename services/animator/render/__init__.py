"""A take as a picture or a film, without a screen: the actor as smooth shaded solids on a floor."""
