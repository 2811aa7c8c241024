"""The services of a rig, one folder each; none of them imports another."""
