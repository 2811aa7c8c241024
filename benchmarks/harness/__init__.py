"""Benchmarks: cases as data, run in a pool, cached by their sources, stored and published."""
