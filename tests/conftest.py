"""Settings of every test: hypothesis tries the same examples each time, so that a red run can be repeated."""

from hypothesis import settings

settings.register_profile("zenocap", derandomize=True, deadline=None)
settings.load_profile("zenocap")
