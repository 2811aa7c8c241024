"""`zenocap replay`: a take's messages on the network again, at their recorded intervals."""
