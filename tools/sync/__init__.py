"""Times at which the videos of a rig begin, found from their sound or from the silhouettes of the person."""
