"""Equal warnings about several files are one line with their number."""

import threading
from pathlib import Path

import pytest

from zenocap.common.errors import UserError
from zenocap.common.formats.file_warnings import grouped_warnings, warn_of_file

FILES = tuple(map(Path, ("a.bvh", "b.bvh", "c.bvh")))


def test_equal_warnings_of_a_block_are_one_line_at_its_end(caplog: pytest.LogCaptureFixture) -> None:
    with grouped_warnings():
        for file in FILES:
            warn_of_file(file, "z is taken for up")
            warn_of_file(file, "z is taken for up")  # of a file that is read twice
        for file in FILES[1:]:
            warn_of_file(file, "no LTHI")
        warn_of_file(FILES[0], "no RTHI")
        assert not caplog.messages
    assert caplog.messages == [
        "a.bvh and 2 more files: z is taken for up",
        "b.bvh and 1 more file: no LTHI",
        "a.bvh: no RTHI",
    ]


def test_outside_a_block_a_warning_is_a_line_at_once(caplog: pytest.LogCaptureFixture) -> None:
    for file in FILES[:2]:
        warn_of_file(file, "100 % of it: z is taken for up")
    assert caplog.messages == ["a.bvh: 100 % of it: z is taken for up", "b.bvh: 100 % of it: z is taken for up"]


def test_warnings_are_logged_after_an_error_and_only_then_by_an_outer_block(caplog: pytest.LogCaptureFixture) -> None:
    @grouped_warnings()
    def read() -> None:
        with grouped_warnings():
            warn_of_file(FILES[0], "z is taken for up")
        assert not caplog.messages
        warn_of_file(FILES[1], "z is taken for up")
        raise UserError("c.bvh: no joints")

    with pytest.raises(UserError):
        read()
    assert caplog.messages == ["a.bvh and 1 more file: z is taken for up"]


def test_another_thread_logs_its_own_warnings(caplog: pytest.LogCaptureFixture) -> None:
    with grouped_warnings():
        thread = threading.Thread(target=warn_of_file, args=(FILES[0], "z is taken for up"))
        thread.start()
        thread.join()
        assert caplog.messages == ["a.bvh: z is taken for up"]
