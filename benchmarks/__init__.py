"""Benchmarks: they compute as the package does, whichever of them imports numpy first."""

import zenocap as zenocap
