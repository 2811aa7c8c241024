"""Chaos: a seeded schedule of faults against a whole rig, and the invariants that must hold."""
