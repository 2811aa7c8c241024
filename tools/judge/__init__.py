"""Verdict on a take, without truth: usable or not, and what to change."""
