"""Compilation of the machine code of services before their start: `zenocap warmup`, and the start of a rig."""
