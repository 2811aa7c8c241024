"""One Chromium for all tests of pages; each takes a browser context of its own."""

from collections.abc import Iterator

import pytest

from tests.support.browser import chromium


@pytest.fixture(scope="package")
def browser() -> Iterator[object]:
    """Ends with the last test of this folder: as long as playwright runs, `asyncio.run` does not work in this process."""
    with chromium() as one:
        yield one


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """In one worker, so that one Chromium serves them all; with time for a machine that has much else to do."""
    for item in items:
        if "browser" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.xdist_group("browser"))
            item.add_marker(pytest.mark.timeout(600))
