"""`zenocap load` and `zenocap plan`: what a machine processes, what an installation needs."""
