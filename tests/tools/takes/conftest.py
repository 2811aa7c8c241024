"""Takes that tests of several files read."""

from pathlib import Path

import pytest

from tests.support.arms_takes import both_ways_take, forward_take
from tests.support.export_takes import tracked_take, two_view_take


@pytest.fixture(scope="session")
def two_view(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return two_view_take(tmp_path_factory.mktemp("two-view") / "take.mcap")


@pytest.fixture(scope="session")
def tracked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tracked_take(tmp_path_factory.mktemp("tracked") / "take.mcap")


@pytest.fixture(scope="session")
def takes(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The same film tracked forwards only, and both ways."""
    folder = tmp_path_factory.mktemp("takes")
    return forward_take(folder / "forward"), both_ways_take(folder / "both")
