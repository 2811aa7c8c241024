"""`up --no-log` and `kill -9` of a service: the statement at the end about the take is true."""

import os
import re
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from benchmarks.chaos.observer import Observer
from benchmarks.chaos.schedule import SERVICES
from tests.support.demo_rigs import written_demo
from tests.support.networks import free_endpoint
from tests.support.processes import all_run, ended, output_of, service_pids, started, wait_for_frames, wait_until
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Envelope
from zenocap.common.messages import PROCESS
from zenocap.common.recording.reader import TakeReader
from zenocap.common.topics import Queueing, service_at, topic_at
from zenocap.tools.record.launcher.shell import LOSS

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="finds processes in /proc"),
]
RECORDED = 60  # frames with a pose before the kill and after it
WITNESS = "2"  # the viewer that is never killed


@dataclass(frozen=True)
class Run:
    """status, text: of `up`.  killed_ns, again_ns: the kill, and the second health of the next process.

    frames: received from WITNESS, with their times.  take: None without one.
    """

    status: int
    text: str
    killed_ns: int
    again_ns: int
    frames: dict[int, int]
    take: Path | None


@contextmanager
def observed(endpoint: str) -> Iterator[Observer]:
    observer = Observer(endpoint, "demo", ("1", WITNESS), SERVICES, frames=True)
    observer.start()
    try:
        yield observer
    finally:
        observer.close()


def run_with_a_kill(folder: Path, service: str, *, records: bool) -> Run:
    """Kill a service once the rig tracks, and end the rig when it tracks again.  records: whether its user does."""
    place, takes = free_endpoint(), folder / "takes"
    takes.mkdir()
    network = ["-m", "client", "-e", place, "--no-multicast-scouting"]
    line = ["up", written_demo(folder), "--no-log", "--no-page", "--recordings", takes, *network]
    with (
        started(["router", "-l", place, "--no-multicast-scouting"], folder),
        started(line, folder) as up,
        observed(place) as observer,
    ):
        wait_until(lambda: all_run(folder), folder, running=[up])
        if records:
            observer.request("record")
            wait_until(lambda: any(takes.glob("*.mcap")), folder, running=[up])
        wait_for_frames(folder, RECORDED)
        before = {one.health.counts.get(PROCESS) for one in observer.health}
        os.kill(service_pids(up.pid)[service], signal.SIGKILL)
        killed_ns = time.time_ns()

        def healths() -> list[int]:
            return [
                one.received_ns
                for one in observer.health
                if one.service == service and one.health.counts.get(PROCESS) not in before
            ]

        wait_until(lambda: len(healths()) > 1, folder, running=[up])
        wait_for_frames(folder, RECORDED)
        status = ended(up, signal.SIGINT)
        frames = {one.frame: one.received_ns for one in reversed(observer.frames[WITNESS])}
        found = list(takes.glob("*.mcap"))
        return Run(status, output_of(folder), killed_ns, healths()[1], frames, found[0] if found else None)


def numbers(pattern: str, text: str) -> list[int]:
    """Numbers of the one place in a text."""
    (found,) = re.findall(pattern, text)
    return [int(one) for one in (found if isinstance(found, tuple) else (found,))]


def counted_in(take: Path) -> int:
    """Messages of a take that their service has counted as sent."""
    keys = [one.topic for one in TakeReader(take).messages()]
    topics = {key: topic_at(key) for key in {*keys}}
    return sum(1 for key in keys if (topic := topics[key]) and topic.queueing is not Queueing.LATCHED and service_at(key))


def holds(run: Run) -> int:
    """Check the sums of a statement on a take; returns the number of lost messages."""
    assert run.take is not None
    sent, *terms = numbers(
        r"messages: (\d+) sent = (\d+) in the takes \+ (\d+) dropped by the queue of the log \+ "
        r"(\d+) never arrived at a log \+ (\d+) refused by the writer \+ (\d+) sent while no take was written", run.text,
    )  # fmt: skip
    assert sent == sum(terms)
    in_the_take, dropped, never, refused, _ = terms
    assert in_the_take == counted_in(run.take)
    (lost,) = numbers(r"take: .*\.mcap: \d+ messages, (\d+) lost", run.text)
    assert lost == dropped + never + refused
    assert lost == sum(int(one) for one in re.findall(r"sent, (\d+) of them lost", run.text))
    return lost


def test_a_killed_viewer_of_a_run_that_records_nothing_leaves_frames_without_a_count(tmp_path: Path) -> None:
    run = run_with_a_kill(tmp_path, "viewer 1", records=False)
    assert "viewer 1: died (SIGKILL)" in run.text
    assert run.take is None
    assert "take: " not in run.text
    assert re.search(r"\d lost", run.text) is None
    assert "not counted: what viewer 1 captured from " in run.text
    assert run.status == LOSS, run.text


def test_a_killed_viewer_leaves_a_time_without_a_count(tmp_path: Path) -> None:
    run = run_with_a_kill(tmp_path, "viewer 1", records=True)
    holds(run)
    assert "not counted: what viewer 1 sent from " in run.text
    assert ", and an unknown number in " in run.text
    assert "; cut: " not in run.text
    assert run.status == LOSS, run.text


def test_a_killed_integrator_loses_what_was_sent_until_the_next_one_records_nothing(tmp_path: Path) -> None:
    run = run_with_a_kill(tmp_path, "integrator", records=True)
    assert holds(run) > 0
    assert run.take is not None
    assert f"{run.take}: " in run.text
    assert "; cut: its integrator did not close it" in run.text
    recorded = {one.message.frame for one in sightings_in(run.take)}
    (lost,) = numbers(rf"  sighting of viewer {WITNESS}: \d+ sent, (\d+) of them lost", run.text)
    missing = {frame: at_ns for frame, at_ns in run.frames.items() if frame > min(recorded) and frame not in recorded}
    until_the_kill = sum(at_ns <= run.killed_ns for at_ns in missing.values())
    until_the_next = sum(at_ns <= run.again_ns for at_ns in missing.values())
    assert until_the_kill <= lost <= until_the_next
    assert until_the_next < len(missing)  # and no more of what was sent later
    assert run.status == LOSS, run.text


def sightings_in(take: Path) -> list[Envelope]:
    """Sightings of WITNESS, also in a cut take."""
    found = TakeReader(take).envelopes()
    return [one for one in found if isinstance(one.message, m.Sighting) and one.message.viewer == WITNESS]
