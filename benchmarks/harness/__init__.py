"""Benchmarks: cases as data, run in a pool, cached by their sources, stored as JSON and published in the pages."""
