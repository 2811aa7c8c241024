"""Faults of a rig whose services run on hosts of their own: what the others did, and how soon all was well again."""
