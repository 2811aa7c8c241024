"""Settings of the system tests."""

from pathlib import Path

import pytest

HANG_S = 900.0  # time limit of a test that states none: several times that for reaching one state (s)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if item.path.is_relative_to(Path(__file__).parent) and item.get_closest_marker("timeout") is None:
            item.add_marker(pytest.mark.timeout(HANG_S))
