"""The zenocap services, one folder each, and the command line."""
