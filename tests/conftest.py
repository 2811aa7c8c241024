"""Settings of all tests."""

from hypothesis import settings

# The same examples in each run, so that a failure is reproducible.
settings.register_profile("zenocap", derandomize=True, deadline=None)
settings.load_profile("zenocap")
