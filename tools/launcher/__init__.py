"""`zenocap up` and `zenocap demo`: run every service of a rig as a process, supervise them, and display their status."""
