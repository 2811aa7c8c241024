"""The cameras of a machine: announced, filmed, and used by viewers of rigs; and the films of a running viewer."""
