"""ChildProcesses: restarts after growing pauses, limit of failed starts, no leftovers."""

import errno
import io
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import IO
from unittest.mock import Mock

import pytest

from tests.support.live_cameras import until
from tests.support.processes import ENVIRONMENT, ZENOCAP
from zenocap.common.errors import UserError
from zenocap.common.runtime.signals import HANGS_S
from zenocap.tools.record.launcher import child_processes


class FakeProcess:
    """A process that ends on the test's command."""

    def __init__(self) -> None:
        self.pid = 1
        self.status: int | None = None
        self.signals: list[int] = []
        self.stubborn, self.ends_with = False, 0
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
            self.status = self.ends_with

    def kill(self) -> None:
        self.status = -9


class Harness:
    """ChildProcesses with fake processes and a manual clock."""

    def __init__(self, names: Sequence[str] = ("viewer 1",), refused: OSError | None = None) -> None:
        """refused: what a start raises."""
        self.now_s = 0.0
        self.started: list[FakeProcess] = []
        self.refused = refused
        commands = [(name, [name]) for name in names]
        self.children = child_processes.ChildProcesses(commands, lambda: self.now_s, self._start, ["viewer of a video"])
        self.children.start()

    def _start(self, arguments: Sequence[str]) -> FakeProcess:
        if self.refused is not None:
            raise self.refused
        self.started.append(FakeProcess())
        return self.started[-1]

    def pass_time(self, seconds: float) -> None:
        self.now_s += seconds
        self.children.poll()

    def end_newest(self, status: int, after_s: float) -> str:
        """End the newest process; return the log lines."""
        self.started[-1].status = status
        self.pass_time(after_s)
        return "\n".join(self.children.lines())


def test_a_machine_that_starts_no_process_is_tried_again_or_named_at_once() -> None:
    full = OSError(errno.EMFILE, "Too many open files")
    first = Harness(["viewer 1", "viewer 2"], full)
    assert [child.name for child in first.children.given_up] == ["viewer 1", "viewer 2"]
    assert "viewer 2: cannot be started: Too many open files; not started again" in first.children.lines()
    harness = Harness()
    harness.end_newest(-9, child_processes.SETTLED_S)
    harness.refused = full
    harness.pass_time(0.2)
    assert "cannot be started: Too many open files; starting it again in 0.1 s" in "\n".join(harness.children.lines())
    harness.refused = None
    harness.pass_time(0.6)
    assert len(harness.started) == 2
    assert harness.children.given_up == []


def test_killed_process_is_restarted_after_a_pause() -> None:
    harness = Harness()
    assert "died (SIGKILL); starting it again in 0.1 s" in harness.end_newest(-9, 1.0)
    harness.pass_time(0.05)
    assert len(harness.started) == 1
    harness.pass_time(0.06)
    assert len(harness.started) == 2
    assert any("started again" in line for line in harness.children.lines())
    assert "no health, for 120 s and was ended (SIGALRM); starting it again in 1 s" in harness.end_newest(-14, 1.0)


def test_output_that_another_process_holds_open_delays_no_restart() -> None:
    harness, waits = Harness(), list[float]()
    harness.children.all[0].reader = Mock(join=waits.append)
    harness.end_newest(-9, 1.0)
    assert waits == [child_processes.SHORT_PAUSE_S]


def test_restart_pause_grows_and_is_reset_by_a_long_run() -> None:
    harness = Harness()
    pauses = []
    for _ in range(3):
        pauses.append(harness.end_newest(-9, 1.0).rpartition(" in ")[2])
        harness.pass_time(10.0)
    assert pauses == ["0.1 s", "1 s", "2 s"]
    assert " in 0.1 s" in harness.end_newest(-9, child_processes.SETTLED_S + 1)


@pytest.mark.parametrize(
    ("status", "after_s", "words", "starts", "given_up"),
    [
        (1, 2.0, "failed (exit status 1) after 2.0 s; not started again", 1, ["viewer 1"]),
        (1, child_processes.SETTLED_S + 1, "starting it again", 2, []),
        (0, 1.0, "ended, although it was to run on (exit status 0); starting it again in 0.1 s", 2, []),
        (3, 1.0, "ended, although it was to run on (exit status 3); starting it again in 0.1 s", 2, []),
    ],
    ids=["failed-at-its-first-start", "failed-after-a-long-run", "stopped", "stopped-with-loss"],
)
def test_what_follows_the_end_of_a_process(status, after_s, words, starts, given_up):
    harness = Harness()
    assert words in harness.end_newest(status, after_s)
    assert [child.name for child in harness.children.given_up] == given_up
    harness.pass_time(100)
    assert len(harness.started) == starts


def test_a_viewer_of_a_video_finishes_and_is_not_started_again() -> None:
    harness = Harness(["viewer of a video"])
    assert harness.end_newest(0, 1.0) == "a line\nviewer of a video: finished"
    harness.pass_time(100)
    assert len(harness.started) == 1
    assert harness.children.given_up == []


@pytest.mark.parametrize("status", [-11, 0])
def test_process_with_repeated_short_runs_is_given_up(status: int) -> None:
    harness = Harness()
    for _ in range(child_processes.QUICK_FAILURES):
        harness.end_newest(status, 0.1)
        harness.pass_time(10.0)
    assert len(harness.started) == child_processes.QUICK_FAILURES
    assert harness.children.given_up


def test_process_that_has_run_once_is_started_again_until_the_end() -> None:
    """Such as one whose name another process has taken: its pauses grow, and it is not given up."""
    harness = Harness()
    harness.end_newest(-9, child_processes.SETTLED_S + 1)
    pauses = []
    for _ in range(4 * child_processes.QUICK_FAILURES):
        harness.pass_time(100.0)
        pauses.append(harness.end_newest(1, 0.5).rpartition(" in ")[2])
    assert not harness.children.given_up
    assert len(harness.started) == 4 * child_processes.QUICK_FAILURES + 1
    assert (*pauses[:2], pauses[-1]) == ("0.1 s", "1 s", "60 s")
    harness.children.stop()
    assert [child.status for child in harness.children.all] == [1]  # it did not run at the end


def test_process_that_ignores_sigterm_prints_its_stacks_and_is_killed() -> None:
    harness = Harness(("a", "b"))
    harness.started[0].stubborn = True
    harness.children.stop()
    assert [process.signals for process in harness.started] == [[signal.SIGTERM, signal.SIGUSR1], [signal.SIGTERM]]
    assert harness.started[0].status == -9
    lines = harness.children.lines()
    asked, killed = (index for index, line in enumerate(lines) if line.startswith("a: "))
    assert "has not stopped in 8 s; the stacks" in lines[asked]
    assert "was killed" in lines[killed]
    assert [child.name for child in harness.children.given_up] == ["a"]


def test_a_process_that_is_stopped_before_it_has_a_handler_has_not_failed() -> None:
    """Ctrl-C during the start of a rig said that its integrator had failed."""
    harness = Harness()
    harness.started[0].ends_with = -signal.SIGTERM
    harness.children.stop()
    assert harness.children.given_up == []


def test_a_launcher_that_is_to_stop_starts_no_process() -> None:
    def refused(arguments: Sequence[str]) -> FakeProcess:
        raise InterruptedError

    children = child_processes.ChildProcesses([("a", ["a"]), ("b", ["b"])], lambda: 0.0, refused)
    children.start()
    children.stop()
    assert [(child.process, child.status) for child in children.all] == [(None, None)] * 2


def test_no_process_is_restarted_while_stopping() -> None:
    harness = Harness()
    harness.end_newest(-9, 1.0)
    harness.children.stop()
    harness.pass_time(100)
    assert len(harness.started) == 1


@pytest.mark.core
def test_a_child_ends_with_its_parent(tmp_path: Path) -> None:
    """A parent that is killed closes the pipe that is its child's standard input."""
    report = tmp_path / "report"
    child = (
        "import time; from pathlib import Path; from zenocap.common.runtime.signals import stop_signals\n"
        "with stop_signals(with_parent=True) as stopped:\n"
        f"    report = Path({str(report)!r}); report.write_text('runs')\n"
        "    while not stopped(): time.sleep(0.01)\n"
        "    report.write_text('stopped')\n"
    )
    parent = (
        "import sys, time; from zenocap.tools.record.launcher.child_processes import spawn\n"
        f"print(spawn([sys.executable, '-c', {child!r}]).pid, flush=True); time.sleep(600)\n"
    )
    with subprocess.Popen([sys.executable, "-c", parent], stdout=subprocess.PIPE, text=True) as process:
        try:
            pid = int(process.stdout.readline())
            until(lambda: report.exists() and is_running(pid), "the start of the child")
        finally:
            process.kill()
    until(lambda: not is_running(pid), "the end of the child")
    assert report.read_text() == "stopped"


@pytest.mark.core
def test_error_output_of_a_child_is_logged() -> None:
    program = [sys.executable, "-c", "import sys; sys.exit('no such camera')"]
    children, lines = child_processes.ChildProcesses([("a", program)], time.monotonic, child_processes.spawn), list[str]()
    children.start()

    def is_given_up() -> bool:
        children.poll()
        lines.extend(children.lines())
        return bool(children.given_up)

    until(is_given_up, "the end of the child")
    children.stop()
    assert "no such camera" in [*lines, *children.lines()]


def is_running(pid: int) -> bool:
    """Whether a process exists and has not ended; an ended orphan may not have been waited for."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.parametrize(
    ("limits", "soft"),
    [
        ((1024, 20_000), child_processes.WANTED_FILES),
        ((256, 1024), 1024),
        ((256, resource.RLIM_INFINITY), child_processes.WANTED_FILES),
        ((1024, 1024), None),
        ((20_000, 20_000), None),
        ((resource.RLIM_INFINITY, resource.RLIM_INFINITY), None),
    ],
)
def test_a_rig_may_open_as_many_files_as_the_system_allows(monkeypatch, limits, soft):
    """Of macOS and many shells a process may open 256 files or 1024, and raise that itself."""
    raised: list[tuple[int, int]] = []
    monkeypatch.setattr(resource, "getrlimit", lambda kind: limits)
    monkeypatch.setattr(resource, "setrlimit", lambda kind, values: raised.append(values))
    child_processes.allow_files()
    assert raised == ([] if soft is None else [(soft, limits[1])])


def test_too_few_open_files_are_an_error_with_the_command_that_allows_more(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resource, "getrlimit", lambda kind: (64, 255))
    with pytest.raises(UserError, match=r"^open files = 255: allowed: at least 256: the hard limit"):
        child_processes.allow_files()


@pytest.mark.slow
def test_a_rig_that_may_open_too_few_files_ends_at_once_with_one_line(tmp_path: Path) -> None:
    """It was the free ports of the machine that were said to be too few."""
    limited = ["sh", "-c", 'ulimit -n 64; exec "$@"', "sh", *ZENOCAP, "demo", "--seconds", "1", "--port", "0"]
    done = subprocess.run(limited, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == "error: open files = 64: allowed: at least 256: the hard limit, see LimitNOFILE\n"


@pytest.mark.parametrize(
    ("first_s", "others", "ended"),
    [(1.0, True, True), (1.0, False, False), (0.0, True, False)],
    ids=["others send theirs", "no other one does: the launcher has no network", "it has sent none yet: it loads"],
)
def test_a_service_that_runs_on_without_a_health_is_ended(first_s: float, others: bool, ended: bool) -> None:
    """Without memory Zenoh's threads had ended, and the service ran on without a network and without a word."""
    harness = Harness(("tracker", "viewer 1"))
    for now_s in range(1, int(HANGS_S + 10)):
        harness.now_s = float(now_s)
        harness.children.end_silent({"tracker": first_s, "viewer 1": harness.now_s if others else 1.0}, 1.0)
    assert [one.signals for one in harness.started] == [[signal.SIGALRM] if ended else [], []]
    assert ("tracker: no health for 120 s, while others send theirs: ended" in harness.children.lines()) == ended
