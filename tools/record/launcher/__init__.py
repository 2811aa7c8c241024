"""`zenocap up` and `zenocap demo`: all services of a rig as supervised processes."""
