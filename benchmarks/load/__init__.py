"""Capacity of a deployment, and its dependence on Zenoh settings.  See `__main__`."""
