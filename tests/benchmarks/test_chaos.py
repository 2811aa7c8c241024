"""Schedule, gate and invariants of benchmarks.chaos."""

import itertools
import os
import random
import re
import socket
import subprocess
import sys
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from benchmarks.chaos import invariants
from benchmarks.chaos.gate import LinkGate
from benchmarks.chaos.hostile import false_orders
from benchmarks.chaos.observer import Observer, Place, SeenFrame, SeenHealth, SeenPose, settled_ns
from benchmarks.chaos.outcome import RunOutcome
from benchmarks.chaos.run import CHAOS, Run
from benchmarks.chaos.running_rig import RunningRig, Seen
from benchmarks.chaos.schedule import (
    FLOODS,
    KINDS,
    PAGE_FLOODS,
    SERVICES,
    SKEWED_NS,
    VIEWERS,
    Fault,
    Round,
    schedule,
)
from benchmarks.chaos.stated import wrong_statement
from benchmarks.chaos.takes import POSES, Content, content, missing_poses
from benchmarks.harness.case import case
from tests.support.built_messages import built
from tests.support.places import ROOT
from zenocap.common import codec
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Envelope
from zenocap.common.bus.zenoh_session import free_ports
from zenocap.common.topics import REQUEST, SIGHTING

S = 1_000_000_000


def rounds(seed: int, count: int, kinds: tuple[str, ...] = ()) -> list[Round]:
    return list(itertools.islice(schedule(seed, kinds), count))


def pose(at_s: float, *, frame: int = 0, lost: bool = False, views: int = 3) -> SeenPose:
    return SeenPose(round(at_s * S), round(at_s * S) - 1, frame, lost, views)


def health(at_s: float, log_on: int, *, lost: int = 0, ended: int = 0) -> SeenHealth:
    counts = {"log_on": log_on, "log_lost": lost, m.ENDED: ended}
    message = built(m.Health, service="integrator", id="main", counts=counts)
    return SeenHealth(round(at_s * S), "integrator", message)


def seen(name: str = "tracker", *, rss: list[int] | None = None, files: list[int] | None = None) -> Seen:
    values = rss or [0] * len(files or [])
    row = [(number * 20 * S, value) for number, value in enumerate(values)]
    opened = [(number * 20 * S, value) for number, value in enumerate(files or [])]
    return Seen(name, 7, 0, row, opened)


def test_equal_seeds_give_equal_schedules_and_others_do_not() -> None:
    assert rounds(3, 50) == rounds(3, 50)
    assert rounds(3, 50) != rounds(4, 50)


def test_a_schedule_has_every_kind_and_target() -> None:
    faults = [fault for round in rounds(1, 1000) for fault in round.faults]
    drawn = [kind for kind in KINDS if kind.weight]
    assert {(fault.kind, fault.target) for fault in faults} == {(kind.name, one) for kind in drawn for one in kind.targets}
    assert {*SERVICES, *FLOODS, *PAGE_FLOODS} <= {fault.target for fault in faults}


def test_two_faults_of_a_round_can_be_told_apart() -> None:
    pairs = [round.faults for round in rounds(2, 1000) if len(round.faults) == 2]
    assert pairs
    assert all(first.kind != second.kind and not first.hits & second.hits for first, second in pairs)


def test_only_the_chosen_kinds_are_drawn() -> None:
    assert {fault.kind for round in rounds(1, 100, ("kill", "page")) for fault in round.faults} == {"kill", "page"}
    named = {fault.target for round in rounds(1, 100, ("impostor", "tracker")) for fault in round.faults}
    assert named == {"impostor", "tracker"}


def test_no_false_order_is_a_valid_one_of_the_rig() -> None:
    for key, data in false_orders("rig", random.Random(1)):
        if key == REQUEST.at("rig"):
            with pytest.raises(codec.BadMessage):
                codec.decode(data, m.Request)


def test_poses_count_as_back_only_when_five_follow_each_other() -> None:
    four = [pose(10 + number / 15) for number in range(4)]
    assert settled_ns(four, 0) is None
    five = [pose(12 + number / 15) for number in range(5)]
    assert settled_ns([*four, *five], 0) == 12 * S
    assert settled_ns([*four[:3], pose(11, lost=True), *five[:4]], 0) is None


def test_a_pose_that_no_take_has_is_missing() -> None:
    poses = [pose(each, frame=each) for each in range(10, 30)]
    recorded = {(each.captured_ns, each.frame) for each in poses if each.frame != 20}
    take = Content(Path("take"), 0, {POSES[0]: recorded}, 10 * S, 30 * S)
    assert [each.frame for each in missing_poses(poses, [take], [])] == [20]
    assert missing_poses(poses, [take], [(19 * S, 21 * S)]) == []


def test_a_service_that_nobody_killed_must_not_end() -> None:
    ended = Seen("viewer 1", 5, 0, ended_ns=S)
    assert invariants.unexpected_ends([ended], {5}) == []
    assert "viewer 1" in invariants.unexpected_ends([ended], set())[0]


def test_poses_may_pause_while_a_service_that_makes_them_is_ended() -> None:
    paused = [name for name in SERVICES if Fault("terminate", name, 0.0).disturbs_poses]
    assert paused == [*VIEWERS, "integrator", "tracker"]


@pytest.mark.parametrize("violations", [[], ["seed 0: viewer 1 ended by itself"]])
def test_a_run_with_a_violation_names_it_and_does_not_hold(
    violations: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(Run, "run", lambda _, folder: RunOutcome(0, 1.0, violations=violations))
    assert CHAOS.run(case("random"))["holds"] == (not violations)
    assert re.findall("violation: (.*)", capsys.readouterr().out) == violations


def test_growing_memory_and_open_files_are_found() -> None:
    assert invariants.large_processes([seen(rss=[100 << 20] * 4, files=[20] * 4)]) == []
    assert "memory" in invariants.large_processes([seen(rss=[100 << 20] * 3 + [500 << 20])])[0]
    assert "at the end" in invariants.large_processes([seen(files=[20, 20, 70])])[0]
    assert "open files" in invariants.large_processes([seen(files=[20, 600, 20])])[0]


def test_tracebacks_and_long_logs_are_found() -> None:
    assert invariants.log_problems("a line", 1000, 60) == []
    assert invariants.log_problems("Traceback (most recent call last):\nError", 1000, 60)
    assert invariants.log_problems("", 1_000_000, 60)


def test_a_recording_that_changes_without_a_true_order_is_found() -> None:
    states = [health(10, 1), health(11, 0)]
    during = [(10 * S, 12 * S)]
    assert invariants.obeyed_orders(states, during, [])
    assert not invariants.obeyed_orders(states, during, [10 * S])
    assert not invariants.obeyed_orders([health(10, 1), health(11, 1)], during, [])
    assert not invariants.obeyed_orders([health(10, 1), health(11, 0, ended=1), health(12, 1)], during, [])  # of the next


def test_losses_count_at_other_times_than_those_of_a_deleted_take() -> None:
    states = [health(10, 1, lost=0), health(11, 1, lost=300), health(12, 1, lost=302)]
    assert invariants.counted_losses(states, [(round(10.5 * S), round(11.5 * S))]) == 2
    assert invariants.counted_losses(states, []) == 302


SUMS = """take: a.mcap: 9 messages, 2 lost
messages: 8 sent = 5 in the takes + 0 dropped by the queue of the log + 2 never arrived at a log + 0 refused by the writer \
+ 1 sent while no take was written
  tracker_pose of tracker: 5 sent, 2 of them lost
"""
NOT_COUNTED = "not counted: what tracker sent from 00:00:40.0 UTC to 00:00:41.0 UTC, after its last report\n"
STATED = f"{SUMS}{NOT_COUNTED}"
OF_POSES = "tracker_pose of tracker"


@pytest.mark.parametrize(
    ("old", "new", "status", "poses", "expected"),
    [
        ("", "", 3, (1, 20, 21, 22, 40.5), None),
        ("", "", 3, (1, 20, 21, 22, 23), f"4 {OF_POSES} are in no take, 2 are stated as lost, 1 as sent without a take"),
        ("", "", 0, (1,), "status 0 with 2 lost, 1 times not counted"),
        ("8 sent", "9 sent", 3, (1,), "9 sent are not 5 + 2 + 1"),
        ("messages, 2 lost", "messages, 1 lost", 3, (1,), "1 lost are not 2"),
        ("5 sent, 2 of", "5 sent, 1 of", 3, (1,), "topics have lost 1, all 2"),
        ("report\n", "report\n  and more\n", 3, (1, 20, 21, 22, 23), None),  # which may be of a time that is not named
        ("2 of them lost\n", f"1 of them lost\n{NOT_COUNTED}  and more\n", 3, (1,), "topics have lost 1, all 2"),
        ("8 sent = 5", "9 sent = 6", 3, (1,), "6 in the takes, which have 5"),
        ("9 messages", "8 messages", 3, (1,), "a.mcap: 8 messages stated, 9 read"),
        ("messages: 8", "8", 3, (1,), "none on the messages"),
    ],
)
def test_a_statement_that_contradicts_the_takes_or_the_observer_is_found(
    old: str, new: str, status: int, poses: tuple[float, ...], expected: str | None
) -> None:
    seen_poses = [pose(each) for each in poses]
    take = Content(Path("a.mcap"), 9, {POSES[0]: {(seen_poses[0].captured_ns, 0)}}, whole=True, counted=5)
    found = wrong_statement(STATED.replace(old, new), status, [take], {POSES[0]: seen_poses})
    assert [line.removeprefix("statement: ").partition(";")[0] for line in found] == ([expected] if expected else [])


@pytest.mark.parametrize(
    ("last_s", "clock_s", "last_pose_s", "expected"),
    [
        (22, 0, 40.5, []),
        (30, 0, 40.5, [f"statement: 3 {OF_POSES} of the times of takes are in none, 2 are lost"]),
        (30, 21, 40.5, []),
        (22, 44, 44, []),
        (22, 0, 44, [f"statement: 4 {OF_POSES} are in no take, 2 are stated as lost, 1 as sent without a take"]),
    ],
)
def test_poses_are_excused_at_their_own_time_alone(
    last_s: int, clock_s: int, last_pose_s: float, expected: list[str]
) -> None:
    """Those without a take excused losses within one, and a step of the clock those of the whole run."""
    take = Content(Path("a.mcap"), 9, {}, 10 * S, last_s * S, whole=True, counted=5)
    poses = [pose(each) for each in (20, 21, 22, last_pose_s)]
    clock = [(clock_s * S - S // 2, clock_s * S + S // 2)]
    assert wrong_statement(STATED, 3, [take], {POSES[0]: poses}, clock) == expected


@pytest.mark.parametrize(
    ("place", "forged", "expected"),
    [
        (("silhouette", "viewer 1"), 0, "3 silhouette of viewer 1 are in no take, 0 are stated as lost, 1 as sent"),
        (("scene_points", "tracker"), 0, "3 scene_points of tracker are in no take, 0 are stated as lost, 1 as sent"),
        (("silhouette", "viewer 1"), 2, None),  # each hides one
        (POSES[0], 0, None),
    ],
)
def test_a_loss_of_another_topic_excuses_none(place: Place, forged: int, expected: str | None) -> None:
    """Poses alone were compared, with the losses of all topics of their service."""
    take = Content(Path("a.mcap"), 9, {}, whole=True, counted=5, forged=Counter({place: forged}))
    found = wrong_statement(STATED, 3, [take], {place: [SeenFrame(each * S, each * S, each) for each in (20, 21, 22)]})
    assert [line.removeprefix("statement: ").partition(" without")[0] for line in found] == ([expected] if expected else [])


def test_what_services_count_as_sent_is_read_from_a_take_by_topic_and_service() -> None:
    found = content(ROOT / "tests" / "golden" / "both.mcap")
    assert found.recorded.keys() >= {*POSES, *((topic, "viewer 2") for topic in ("silhouette", "sighting", "partial_bap"))}
    assert sum(map(len, found.recorded.values())) == found.counted


def test_an_observer_keeps_what_services_of_the_rig_have_sent() -> None:
    observer = Observer("tcp/127.0.0.1:1", "rig", ["1"], ["viewer 1"], frames=True)
    for viewer, captured_ns in (("1", S), ("1", S + SKEWED_NS), ("1", 20 * S), ("2", S)):
        message = built(m.Sighting, viewer=viewer, frame=7, captured_ns=captured_ns)
        observer._take(Envelope(SIGHTING.at("rig", viewer=viewer), SIGHTING, message, 2 * S))
    assert observer.messages == {("sighting", "viewer 1"): [SeenFrame(2 * S, S, 7)]}


@pytest.mark.slow
@pytest.mark.parametrize(("pid", "ahead_s"), [(0, -3), (1, 0)])
def test_the_clock_of_a_rigs_processes_is_set_and_no_other_one(pid: int, ahead_s: int, tmp_path: Path) -> None:
    rig = RunningRig(tmp_path, tmp_path / "takes", tmp_path / "rig.toml")
    rig.step_clock(pid, -3 * S)
    line = "import time as t; real = t.clock_gettime(t.CLOCK_REALTIME); print(t.time() - real, t.time_ns() / 1e9 - real)"
    done = subprocess.run([sys.executable, "-c", line], env=rig.environment, capture_output=True, text=True, check=True)
    assert [round(float(one)) for one in done.stdout.split()] == [ahead_s, ahead_s]


@pytest.fixture
def echo() -> Iterator[int]:
    """Port of a server that returns what it gets."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            while True:
                try:
                    connection, _ = server.accept()
                except OSError:
                    return
                threading.Thread(target=reply, args=(connection,), daemon=True).start()

        def reply(connection: socket.socket) -> None:
            with connection:
                while data := connection.recv(100):
                    connection.sendall(data)

        threading.Thread(target=serve, daemon=True).start()
        yield int(server.getsockname()[1])


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="finds connections in /proc")
def test_the_gate_cuts_the_links_of_one_service(echo: int) -> None:
    (port,) = free_ports(1)
    with LinkGate(port, echo, lambda _: "viewer 1", lambda: [os.getpid()]) as gate:
        with socket.create_connection(("127.0.0.1", port), 5.0) as link:
            link.settimeout(5.0)
            link.sendall(b"a")
            assert link.recv(1) == b"a"
            assert gate.links("viewer 1") == 1
            gate.cut("viewer 2", "silent")
            gate.cut("viewer 1", "silent")
            link.sendall(b"b")
            link.settimeout(0.3)
            with pytest.raises(TimeoutError):
                link.recv(1)
            link.settimeout(5.0)
            gate.restore("viewer 1")
            assert link.recv(1) == b"b"
            gate.cut("viewer 1", "reset")
            assert link.recv(1) == b""  # closed
            with socket.create_connection(("127.0.0.1", port), 5.0) as refused:
                refused.settimeout(5.0)
                refused.sendall(b"c")
                with suppress(ConnectionResetError):
                    assert refused.recv(1) == b""
        assert gate.unknown == 0
