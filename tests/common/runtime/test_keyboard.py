"""Keys from a real pseudo-terminal, whose settings are always restored."""

import fcntl
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

from tests.support.live_cameras import until
from tests.support.places import ROOT
from tests.support.processes import PATIENCE_S
from zenocap.common.runtime.keyboard import BY_BYTES, Key, Keyboard, keyboard, keys_in


@given(st.lists(st.sampled_from(sorted(BY_BYTES)), max_size=8), st.lists(st.integers(0, 40), max_size=4))
def test_keys_are_decoded_from_any_split_of_their_bytes(pressed: list[bytes], cuts: list[int]) -> None:
    data, rest, found = b"".join(pressed), b"", []
    edges = sorted({min(cut, len(data)) for cut in cuts} | {0, len(data)})
    for start, end in pairwise(edges):
        keys, rest = keys_in(rest + data[start:end])
        found += keys
    assert found == [BY_BYTES[one] for one in pressed]
    assert rest == b""


@given(st.binary(max_size=200))
def test_arbitrary_bytes_raise_no_error(data: bytes) -> None:
    keys, rest = keys_in(data)
    assert len(keys) <= len(data)
    assert len(rest) <= 64


@pytest.mark.parametrize("data", [b"\x1b[5~", b"\x1b[1;5A", b"x", b"\x1bOP", b"\x1b[A"])
def test_unknown_keys_are_ignored(data: bytes) -> None:
    assert keys_in(data + b" ") == ([Key.PAUSE], b"")


def test_without_a_terminal_no_key_is_pressed(tmp_path: Path) -> None:
    with (tmp_path / "in").open("w+") as stream, keyboard(stream) as keys:
        assert not keys
        assert keys.pressed() == []
    assert Keyboard(None).pressed() == []


def test_the_settings_of_another_terminal_are_unchanged() -> None:
    """It is not the controlling terminal, so its settings are not changed."""
    master, slave = pty.openpty()
    before = termios.tcgetattr(slave)
    with os.fdopen(slave, "r") as stream, keyboard(stream) as keys:
        assert not keys
        assert termios.tcgetattr(slave) == before
    os.close(master)


CHILD = """
import sys, time
from zenocap.common.runtime.keyboard import keyboard
from zenocap.common.runtime.signals import stop_signals
with stop_signals() as stopped, keyboard() as keys:
    print("ready", bool(keys), flush=True)
    while not stopped():
        for key in keys.pressed():
            print("key", key.name, flush=True)
            if key.name == "QUIT":
                sys.exit(0)
            if key.name == "STEP":
                raise ValueError("an error in the loop")
        time.sleep(0.01)
print("stopped", flush=True)
"""


class Session:
    """A program in a new session, with a new controlling terminal."""

    def __init__(self) -> None:
        self.master, self.slave = pty.openpty()
        self.before = termios.tcgetattr(self.slave)
        self.output = ""

        self.process = subprocess.Popen(
            [sys.executable, "-c", CHILD], stdin=self.slave, stdout=self.slave, stderr=subprocess.DEVNULL, cwd=ROOT,
            env=os.environ | {"PYTHONPATH": str(ROOT)}, start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(self.slave, termios.TIOCSCTTY, 0),
        )  # fmt: skip

    def until(self, text: str) -> None:
        end_s = time.monotonic() + PATIENCE_S
        while text not in self.output:
            assert time.monotonic() < end_s, self.output
            if select.select([self.master], [], [], 0.1)[0]:
                self.output += os.read(self.master, 4096).decode()

    def press(self, data: bytes) -> None:
        os.write(self.master, data)

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        os.close(self.master)
        os.close(self.slave)


@pytest.fixture
def session() -> Iterator[Session]:
    one = Session()
    try:
        one.until("ready True")
        yield one
    finally:
        one.close()


@pytest.mark.core
@pytest.mark.parametrize("end", ["key", "error", "SIGTERM", "Ctrl-C"])
def test_terminal_settings_are_restored_at_every_kind_of_exit(session: Session, end: str) -> None:
    assert termios.tcgetattr(session.slave) != session.before
    session.press(b" \x1b[C")
    session.until("key AHEAD")
    assert "key PAUSE" in session.output
    assert "^[" not in session.output  # not echoed
    if end == "SIGTERM":
        session.process.send_signal(signal.SIGTERM)
    else:
        session.press({"key": b"q", "error": b".", "Ctrl-C": b"\x03"}[end])
    assert session.process.wait(PATIENCE_S) == (1 if end == "error" else 0)
    assert termios.tcgetattr(session.slave) == session.before


@pytest.mark.core
def test_keys_are_read_again_after_stop_and_continue(session: Session) -> None:
    os.kill(session.process.pid, signal.SIGSTOP)
    termios.tcsetattr(session.slave, termios.TCSANOW, session.before)  # as a shell does
    os.kill(session.process.pid, signal.SIGCONT)
    until(lambda: termios.tcgetattr(session.slave) != session.before)
    session.press(b" ")
    session.until("key PAUSE")
