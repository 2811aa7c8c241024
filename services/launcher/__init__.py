"""`zenocap up` and `zenocap demo`: starts every service of a rig as a process, watches them, and shows what they do."""
