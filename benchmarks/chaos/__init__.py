"""Chaos: a seeded schedule of faults against a whole rig that `zenocap up` runs, and the invariants that must hold."""
