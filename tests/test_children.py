"""Children: who dies is started again after a growing pause, who cannot start is given up, nobody is left behind."""

import io
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from typing import IO

import pytest

from services.launcher.children import QUICK_FAILURES, SETTLED_S, Children, spawn


class FakeProcess:
    """Ends when its test says so."""

    def __init__(self) -> None:
        self.pid = 1
        self.status: int | None = None
        self.signals: list[int] = []
        self.stubborn = False
        self.stderr: IO[str] | None = io.StringIO("a line\n")

    def poll(self) -> int | None:
        return self.status

    def wait(self, timeout: float | None = None) -> int:
        if self.status is None:
            raise subprocess.TimeoutExpired("fake", timeout or 0)
        return self.status

    def send_signal(self, sig: int) -> None:
        self.signals.append(sig)
        if not self.stubborn:
            self.status = 0

    def kill(self) -> None:
        self.status = -9


class Scene:
    """Children of fake processes and a clock that moves by hand."""

    def __init__(self, names: Sequence[str] = ("viewer 1",)) -> None:
        self.now_s = 0.0
        self.started: list[FakeProcess] = []
        self.children = Children([(name, [name]) for name in names], lambda: self.now_s, self._start)
        self.children.start()

    def _start(self, arguments: Sequence[str]) -> FakeProcess:
        self.started.append(FakeProcess())
        return self.started[-1]

    def ends(self, status: int, after_s: float) -> str:
        """The newest process ends; what is said."""
        self.now_s += after_s
        self.started[-1].status = status
        self.children.poll()
        return "\n".join(self.children.lines())


def test_who_is_killed_is_started_again_after_a_pause() -> None:
    scene = Scene()
    assert "died (SIGKILL); starting it again in 0.5 s" in scene.ends(-9, 1.0)
    scene.now_s += 0.4
    scene.children.poll()
    assert len(scene.started) == 1
    scene.now_s += 0.2
    scene.children.poll()
    assert len(scene.started) == 2
    assert scene.children.restarts() == 1
    assert any("started again" in line for line in scene.children.lines())


def test_pauses_grow_and_a_good_run_forgives() -> None:
    scene = Scene()
    pauses = []
    for _ in range(3):
        pauses.append(scene.ends(-9, 1.0).rpartition(" in ")[2])
        scene.now_s += 10.0
        scene.children.poll()
    assert pauses == ["0.5 s", "1 s", "2 s"]
    assert " in 0.5 s" in scene.ends(-9, SETTLED_S + 1)


def test_who_fails_at_its_first_start_is_given_up() -> None:
    scene = Scene()
    assert "failed (exit status 1) after 2.0 s; not started again" in scene.ends(1, 2.0)
    assert [child.name for child in scene.children.given_up] == ["viewer 1"]
    scene.now_s += 100
    scene.children.poll()
    assert len(scene.started) == 1


def test_who_fails_after_a_good_run_is_started_again() -> None:
    scene = Scene()
    assert "starting it again" in scene.ends(1, SETTLED_S + 1)


def test_who_never_lives_long_is_given_up() -> None:
    scene = Scene()
    for _ in range(QUICK_FAILURES):
        scene.ends(-11, 0.1)
        scene.now_s += 10.0
        scene.children.poll()
    assert len(scene.started) == QUICK_FAILURES
    assert scene.children.given_up


def test_who_finishes_is_not_started_again() -> None:
    scene = Scene()
    assert "finished" in scene.ends(0, 1.0)
    scene.now_s += 100
    scene.children.poll()
    assert len(scene.started) == 1
    assert not scene.children.given_up


def test_who_does_not_stop_is_killed() -> None:
    scene = Scene(("a", "b"))
    scene.started[0].stubborn = True
    scene.children.stop()
    assert [process.signals for process in scene.started] == [[signal.SIGTERM], [signal.SIGTERM]]
    assert scene.started[0].status == -9
    assert any("was killed" in line for line in scene.children.lines())


def test_nobody_is_started_again_while_stopping() -> None:
    scene = Scene()
    scene.ends(-9, 1.0)
    scene.children.stop()
    scene.now_s += 100
    scene.children.poll()
    assert len(scene.started) == 1


@pytest.mark.system
def test_a_child_ends_with_its_parent() -> None:
    """A parent that is killed closes the pipe that is its child's standard input."""
    child = (
        "import time; from common.runtime.signals import stop_signals\n"
        "with stop_signals(with_parent=True) as stopped:\n"
        "    while not stopped(): time.sleep(0.01)\n"
    )
    parent = (
        "import sys, time; from services.launcher.children import spawn\n"
        f"print(spawn([sys.executable, '-c', {child!r}]).pid, flush=True); time.sleep(60)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", parent], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    pid = int(process.stdout.readline())
    process.kill()
    process.wait()
    process.stdout.close()
    end_s = time.monotonic() + 20
    while _runs(pid) and time.monotonic() < end_s:
        time.sleep(0.05)
    assert not _runs(pid)


@pytest.mark.system
def test_what_a_child_writes_is_heard() -> None:
    children = Children([("a", [sys.executable, "-c", "import sys; sys.exit('no such camera')"])], time.monotonic, spawn)
    children.start()
    end_s = time.monotonic() + 20
    lines: list[str] = []
    while not children.given_up and time.monotonic() < end_s:
        children.poll()
        lines += children.lines()
    children.stop()
    assert "no such camera" in [*lines, *children.lines()]


def _runs(pid: int) -> bool:
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
