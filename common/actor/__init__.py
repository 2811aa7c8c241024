"""The synthetic actor: a person with a richer body than the tracker's, fifteen postures, and a renderer."""
