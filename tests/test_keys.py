"""Keys from a real pseudo-terminal, which is always left as it was found."""

import os
import pty
import select
import signal
import subprocess
import sys
import termios
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.runtime.keys import BY_BYTES, Key, Keyboard, keyboard, keys_in

ROOT = Path(__file__).parents[1]


@given(st.lists(st.sampled_from(sorted(BY_BYTES)), max_size=8), st.lists(st.integers(0, 40), max_size=4))
def test_keys_are_found_however_their_bytes_are_torn(pressed: list[bytes], cuts: list[int]) -> None:
    data, rest, found = b"".join(pressed), b"", []
    edges = sorted({min(cut, len(data)) for cut in cuts} | {0, len(data)})
    for start, end in pairwise(edges):
        keys, rest = keys_in(rest + data[start:end])
        found += keys
    assert found == [BY_BYTES[one] for one in pressed]
    assert rest == b""


@given(st.binary(max_size=200))
def test_any_bytes_are_taken(data: bytes) -> None:
    keys, rest = keys_in(data)
    assert len(keys) <= len(data)
    assert len(rest) <= 64


@pytest.mark.parametrize("data", [b"\x1b[5~", b"\x1b[1;5A", b"x", b"\x1bOP", b"\x1b[A"])
def test_other_keys_do_nothing(data: bytes) -> None:
    assert keys_in(data + b" ") == ([Key.PAUSE], b"")


def test_without_a_terminal_no_key_is_pressed(tmp_path: Path) -> None:
    with (tmp_path / "in").open("w+") as stream, keyboard(stream) as keys:
        assert not keys
        assert keys.pressed() == []
    assert Keyboard(None).pressed() == []


def test_a_terminal_of_others_is_left_alone() -> None:
    """It is not the controlling terminal: whose keys come from it is not for this process to change."""
    theirs, ours = pty.openpty()
    before = termios.tcgetattr(ours)
    with os.fdopen(ours, "r") as stream, keyboard(stream) as keys:
        assert not keys
        assert termios.tcgetattr(ours) == before
    os.close(theirs)


CHILD = """
import sys, time
from common.runtime.keys import keyboard
from common.runtime.signals import stop_signals
with stop_signals() as stopped, keyboard() as keys:
    print("ready", bool(keys), flush=True)
    while not stopped():
        for key in keys.pressed():
            print("key", key.name, flush=True)
            if key.name == "QUIT":
                sys.exit(0)
            if key.name == "STEP":
                raise ValueError("an error on the way")
        time.sleep(0.01)
print("stopped", flush=True)
"""


class Session:
    """A program in a session of its own, with a new terminal as its controlling one."""

    def __init__(self) -> None:
        self.theirs, self.ours = pty.openpty()
        self.before = termios.tcgetattr(self.ours)
        self.heard = ""

        def own_terminal() -> None:
            import fcntl

            fcntl.ioctl(self.ours, termios.TIOCSCTTY, 0)

        self.process = subprocess.Popen(
            [sys.executable, "-c", CHILD], stdin=self.ours, stdout=self.ours, stderr=subprocess.DEVNULL, cwd=ROOT,
            env=os.environ | {"PYTHONPATH": str(ROOT)}, start_new_session=True, preexec_fn=own_terminal,
        )  # fmt: skip

    def until(self, text: str) -> None:
        end_s = time.monotonic() + 20
        while text not in self.heard:
            assert time.monotonic() < end_s, self.heard
            if select.select([self.theirs], [], [], 0.1)[0]:
                self.heard += os.read(self.theirs, 4096).decode()

    def press(self, data: bytes) -> None:
        os.write(self.theirs, data)

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        os.close(self.theirs)
        os.close(self.ours)


@pytest.fixture
def session() -> Iterator[Session]:
    one = Session()
    try:
        one.until("ready True")
        yield one
    finally:
        one.close()


@pytest.mark.system
@pytest.mark.parametrize("end", ["key", "error", "SIGTERM", "Ctrl-C"])
def test_the_terminal_is_as_before_however_it_ends(session: Session, end: str) -> None:
    assert termios.tcgetattr(session.ours) != session.before
    session.press(b" \x1b[C")
    session.until("key AHEAD")
    assert "key PAUSE" in session.heard
    assert "^[" not in session.heard  # not echoed
    match end:
        case "key":
            session.press(b"q")
        case "error":
            session.press(b".")
        case "SIGTERM":
            session.process.send_signal(signal.SIGTERM)
        case "Ctrl-C":
            session.press(b"\x03")
    assert session.process.wait(10) == (1 if end == "error" else 0)
    assert termios.tcgetattr(session.ours) == session.before


@pytest.mark.system
def test_after_being_stopped_and_continued_keys_come_again(session: Session) -> None:
    os.kill(session.process.pid, signal.SIGSTOP)
    termios.tcsetattr(session.ours, termios.TCSANOW, session.before)  # as a shell does
    os.kill(session.process.pid, signal.SIGCONT)
    end_s = time.monotonic() + 10
    while termios.tcgetattr(session.ours) == session.before:
        assert time.monotonic() < end_s
        time.sleep(0.01)
    session.press(b" ")
    session.until("key PAUSE")
