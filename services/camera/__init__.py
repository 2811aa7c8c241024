"""Cameras of a machine: announced, filmed, and used by viewers of rigs; films of a running viewer."""
