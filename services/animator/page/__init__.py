"""The live page: what browsers are sent and may ask for, and the server that does it."""
