"""Record the videos of the cameras of a rig."""
