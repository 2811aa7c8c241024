"""Lower priority of programs that only read, in their own session only."""

import errno
import logging
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from unittest.mock import Mock

import pytest

from zenocap.common.runtime import priority
from zenocap.common.runtime.priority import AUTOGROUP, NICENESS, lower_priority, session_niceness

linux = pytest.mark.skipif(sys.platform != "linux", reason="nice values of threads and sessions are Linux's")
SHOW = (
    "import logging, os, threading; from pathlib import Path\n"
    "from zenocap.common.runtime.priority import lower_priority\n"
    "logging.basicConfig(level=logging.INFO)\n"
    "done = threading.Event(); other = threading.Thread(target=done.wait); other.start()\n"
    "lower_priority(logging.getLogger())\n"
    "print(*(os.getpriority(os.PRIO_PROCESS, int(n)) for n in os.listdir('/proc/self/task')))\n"
    "group = Path('/proc/self/autogroup'); print(group.read_text() if group.is_file() else '')\n"
    "done.set()\n"
)


def shown(*, own_session: bool) -> tuple[list[str], str, str]:
    """Nice values of the threads, the text of the session, and the log of a process that lowered its priority."""
    done = subprocess.run([sys.executable, "-P", "-c", SHOW], capture_output=True, text=True, start_new_session=own_session)
    threads, session, *_ = [*done.stdout.splitlines(), "", ""]
    return threads.split(), session, done.stderr


@linux
def test_all_threads_and_the_own_session_are_lowered() -> None:
    threads, session, log = shown(own_session=True)
    assert len(threads) >= 2
    assert all(int(value) >= NICENESS for value in threads)
    assert session_niceness(session) >= NICENESS
    assert log == ""


@linux
@pytest.mark.skipif(not AUTOGROUP.is_file(), reason="this kernel does not group tasks by session")
def test_the_session_of_a_terminal_is_left_alone_and_the_log_names_it() -> None:
    before = AUTOGROUP.read_text()
    threads, session, log = shown(own_session=False)
    assert all(int(value) >= NICENESS for value in threads)
    assert session.strip() == before.strip() == AUTOGROUP.read_text().strip()
    if session_niceness(before) < NICENESS:
        assert "only against programs started from the same terminal" in log


@pytest.mark.parametrize(
    ("text", "niceness"),
    [("/autogroup-602 nice 0\n", 0), ("/autogroup-3 nice -5\n", -5), ("/autogroup-602 nice 10\n", 10), ("", NICENESS)],
)
def test_the_value_of_a_session_is_read_from_the_kernels_text(text: str, niceness: int) -> None:
    assert session_niceness(text) == niceness


class Refusing(type(Path())):  # type: ignore[misc]  # the class of this system's paths
    """A file that refuses a number of writes with one error, and keeps what was written after them."""

    left, error, written = 0, errno.EAGAIN, ""

    def is_file(self, *, follow_symlinks: bool = True) -> bool:
        return True

    def read_text(self, *_: object, **__: object) -> str:
        return "/autogroup-1 nice 0\n"

    def write_text(self, data: str, *_: object, **__: object) -> int:
        if type(self).left:
            type(self).left -= 1
            raise OSError(type(self).error, os.strerror(type(self).error))
        type(self).written = data
        return len(data)


@pytest.fixture
def system(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Mock]:
    """Stands in for the file of the session and the nice value of this process; returns what would change the latter."""

    def stand_in(file: Path, niceness: int) -> Mock:
        monkeypatch.setattr(priority, "AUTOGROUP", file)
        monkeypatch.setattr(os, "getpriority", lambda *_: niceness)
        monkeypatch.setattr(os, "setpriority", Mock())
        return os.setpriority

    return stand_in


@pytest.mark.parametrize(("refusals", "error", "line"), [
    (3, errno.EAGAIN, ""),
    (99, errno.EAGAIN, "not lowered against other sessions"),
    (1, errno.EPERM, "not lowered against other sessions"),
])  # fmt: skip
def test_a_busy_kernel_is_asked_again_and_a_refusal_is_one_line(refusals, error, line, system, monkeypatch, caplog):
    system(Refusing("autogroup"), niceness=0)
    monkeypatch.setattr(Refusing, "left", refusals)
    monkeypatch.setattr(Refusing, "error", error)
    monkeypatch.setattr(Refusing, "written", "")
    monkeypatch.setattr(priority, "BETWEEN_S", 0.0)
    monkeypatch.setattr(os, "getsid", lambda _: os.getpid())
    lower_priority(logging.getLogger("test"))
    assert Refusing.written == ("" if line else str(NICENESS))
    assert len(caplog.records) == (1 if line else 0)
    assert line in caplog.text


def test_a_refused_nice_value_is_one_line(system, caplog) -> None:
    system(Path("missing"), niceness=0).side_effect = PermissionError(errno.EPERM, "Operation not permitted")
    lower_priority(logging.getLogger("test"))
    assert caplog.messages == ["priority not lowered: nice value 10: Operation not permitted"]


def test_a_lower_priority_is_kept(system) -> None:
    changed = system(Path("missing"), niceness=19)
    lower_priority(logging.getLogger("test"))
    changed.assert_not_called()
