"""Settings of the system tests, and the rigs that they share."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.support import session_rigs
from tests.support.session_rigs import SessionRig

HANG_S = 1500.0  # time limit of a test that states none: several times that for reaching one state (s)
RIGS = ("two_view", "ring", "secured")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Of the tests that share a rig first those that need it running, then those that read its take."""
    for item in items:
        if item.path.is_relative_to(Path(__file__).parent) and item.get_closest_marker("timeout") is None:
            item.add_marker(pytest.mark.timeout(HANG_S))
    items.sort(key=_order)


def _rigs_of(item: pytest.Item) -> list[str]:
    return [rig for rig in RIGS if f"{rig}_rig" in getattr(item, "fixturenames", ())]


def _order(item: pytest.Item) -> tuple[int, bool]:
    rigs = _rigs_of(item)
    return (RIGS.index(rigs[0]), f"{rigs[0]}_take" in item.fixturenames) if rigs else (len(RIGS), False)


@pytest.fixture
def stack() -> Iterator[ExitStack]:
    """What is to be closed first, before what the test got earlier."""
    with ExitStack() as one:
        yield one


@pytest.fixture(scope="session")
def two_view_rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SessionRig]:
    """The two-view demo, tracking; tests only read from it."""
    with session_rigs.two_view(tmp_path_factory.mktemp("two-view")) as rig:
        yield rig


@pytest.fixture(scope="session")
def two_view_take(two_view_rig: SessionRig) -> Path:
    """The take of the two-view demo, which has ended."""
    return two_view_rig.end()


@pytest.fixture(scope="session")
def ring_rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SessionRig]:
    """Three cameras and the tracker, tracking; tests only read from it."""
    with session_rigs.ring(tmp_path_factory.mktemp("ring")) as rig:
        yield rig


@pytest.fixture(scope="session")
def ring_take(ring_rig: SessionRig) -> Path:
    """The take of the ring, which has ended."""
    return ring_rig.end()


@pytest.fixture(scope="session")
def secured_rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SessionRig]:
    """The two-view demo around a router with certificates, tracking; tests only read from it."""
    with session_rigs.secured(tmp_path_factory.mktemp("secured")) as rig:
        yield rig


@pytest.fixture(scope="session")
def secured_take(secured_rig: SessionRig) -> Path:
    """The take of the secured rig, which has ended."""
    return secured_rig.end()
