"""Log lines: one per event, and one per source for repeated events."""

import io
import logging

import pytest

from zenocap.common.runtime import logs
from zenocap.common.runtime.logs import OncePerSource

LOGGER = logging.getLogger("test.logs")


def test_only_the_first_warning_of_a_kind_from_a_source_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    limiter = OncePerSource(LOGGER)
    for _ in range(3):
        limiter.warn("viewer 1", "invalid", "bad bytes")
        limiter.warn("viewer 1", "names", "another name")
        limiter.warn("viewer 2", "invalid", "bad bytes")
    assert len(caplog.records) == 3
    assert limiter.count("viewer 1", "invalid") == 3


def test_the_number_of_sources_with_own_warnings_is_limited(caplog, monkeypatch):
    monkeypatch.setattr(logs, "MAX_SOURCES", 10)
    limiter = OncePerSource(LOGGER)
    for number in range(1000):
        limiter.warn(f"source {number}", "invalid", "bad bytes")
    assert len(caplog.records) == 11
    assert limiter.count("other sources", "invalid") == 990


def test_a_log_line_has_level_and_service_name() -> None:
    stream = io.StringIO()
    logs.configure("viewer 1", stream=stream)
    LOGGER.warning("the camera is gone")
    LOGGER.debug("not this")
    assert stream.getvalue().endswith("WARNING viewer 1: the camera is gone\n")
    assert stream.getvalue().count("\n") == 1
