"""Kinds of benchmarks: what is measured, on which cases."""
