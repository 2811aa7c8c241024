"""Viewers of rigs that a camera host runs: assigned over the network, with cameras of its own machine."""
