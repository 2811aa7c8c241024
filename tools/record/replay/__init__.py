"""`zenocap replay`: publish the messages of a take again, at their recorded intervals."""
