"""Cores, memory, network and disk that an installation needs, from measured costs: `zenocap plan`."""
