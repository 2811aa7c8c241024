"""Verdict on a take, without truth: whether its poses can be used, and what to change where they cannot."""
