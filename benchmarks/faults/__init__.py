"""Faults of a rig whose services run in network namespaces: effect on the other services, and time to recovery."""
