"""Log lines: one per event, and one per source for what repeats."""

import io
import logging

import pytest

from common.runtime import logs
from common.runtime.logs import OncePerSource

LOGGER = logging.getLogger("test.logs")


def test_only_the_first_of_a_kind_from_a_source_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    once = OncePerSource(LOGGER)
    for _ in range(3):
        once.warn("viewer 1", "invalid", "bad bytes")
        once.warn("viewer 1", "names", "another name")
        once.warn("viewer 2", "invalid", "bad bytes")
    assert len(caplog.records) == 3
    assert once.count("viewer 1", "invalid") == 3


def test_a_flood_of_sources_is_bounded(caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(logs, "MAX_SOURCES", 10)
    once = OncePerSource(LOGGER)
    for number in range(1000):
        once.warn(f"source {number}", "invalid", "bad bytes")
    assert len(caplog.records) == 11
    assert once.count("other sources", "invalid") == 990


def test_a_line_says_who_and_how_bad() -> None:
    root = logging.getLogger()
    handlers, level = root.handlers[:], root.level
    stream = io.StringIO()
    try:
        logs.configure("viewer 1", stream=stream)
        LOGGER.warning("the camera is gone")
        LOGGER.debug("not this")
    finally:
        root.handlers[:], root.level = handlers, level
    assert stream.getvalue().endswith("WARNING viewer 1: the camera is gone\n")
    assert stream.getvalue().count("\n") == 1
