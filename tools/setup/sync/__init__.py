"""Beginnings of a rig's videos, from sound, light or silhouettes."""
