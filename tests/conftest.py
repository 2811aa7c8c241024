"""Settings of all tests."""

import logging
from collections.abc import Iterator

import pytest
from hypothesis import settings

from tests.support.places import CLIPS, MOTIONS

pytest_plugins = ["tests.support.tiers"]

# The same examples in each run, so that a failure is reproducible; more of them with --hypothesis-profile nightly.
settings.register_profile("zenocap", derandomize=True, deadline=None, max_examples=30)
settings.register_profile("nightly", derandomize=True, deadline=None, max_examples=100)
settings.register_profile("search", deadline=None, max_examples=10_000)  # others in each run
settings.load_profile("zenocap")


def pytest_runtest_setup(item: pytest.Item) -> None:
    if item.get_closest_marker("clips") and not (CLIPS.is_dir() and MOTIONS.is_dir()):
        pytest.skip("the shared clips and motions are not beside the checkout")


@pytest.fixture(autouse=True)
def _logging_of_other_tests() -> Iterator[None]:
    """Commands set up logging for their process, on a captured stream that is closed afterwards: set it back."""
    root = logging.getLogger()
    handlers, level = root.handlers[:], root.level
    yield
    root.handlers[:] = handlers
    root.setLevel(level)
