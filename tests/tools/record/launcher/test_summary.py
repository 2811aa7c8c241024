"""Summary of `up`, from takes and last healths; where its members listen."""

import io
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from threading import Barrier
from unittest.mock import Mock

import pytest
from rich.console import Console

from tests.common.bus.test_inbox import bap
from tests.common.recording.test_writer import record_take
from tests.support.built_messages import built
from zenocap.common import messages as m
from zenocap.common.bus import inbox
from zenocap.common.bus.local import LocalBus, LocalNetwork
from zenocap.common.bus.protocol import Envelope
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.recording.writer import Recording
from zenocap.common.rig.animator import AnimatorTable, FoxgloveTable, OutputTable, PageTable
from zenocap.common.rig.rig import demo_rig
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.topics import HEALTH, SILHOUETTE, UNIVERSAL_BAP
from zenocap.tools.record.launcher import shell
from zenocap.tools.record.launcher.child_processes import ChildProcess, ChildProcesses
from zenocap.tools.record.launcher.shell import DONE, FAILED, INTERRUPTED, LOSS, Supervisor, named_ports, places_of

NO_POSE = "no pose: the body is measured when all viewers see a T-pose\n"
SERVICES = [("viewer", "1"), ("integrator", "main")]


def health(service: str, id: str, **counts: int) -> m.Health:
    return built(m.Health, service=service, id=id, counts={"process": 1} | counts)


def whole(path: Path) -> None:
    record_take(path, 90).close()


def cut(path: Path) -> None:
    whole(path)
    content = path.read_bytes()
    path.write_bytes(content[: int(0.7 * len(content))])


def supervised(
    folder: Path, take: Path | None, bus: LocalBus, status: int | None = DONE, viewer: int | None = DONE, *,
    is_terminal: bool = False,
) -> tuple[Supervisor, io.StringIO]:  # fmt: skip
    """Supervisor of children, and its console.  status, viewer: exit status of the integrator, and of the viewer."""
    children = ChildProcesses([], lambda: 0.0)
    children.all += [ChildProcess("viewer 1", (), status=viewer), ChildProcess("integrator", (), status=status)]
    text = io.StringIO()
    console = Console(file=text, width=200, force_terminal=is_terminal)
    return Supervisor(children, bus, SERVICES, folder, take, console, None, SILHOUETTE), text


def summary(
    take: Path, status: int | None, *healths: m.Health, write: Callable[[Path], None] = whole, interrupted: bool = False,
    logged: bool = True,
) -> tuple[int, str]:  # fmt: skip
    """Exit status and text after the children have ended.

    status: exit status of the integrator.  write: writes the takes of the run.  interrupted: by Ctrl-C.
    logged: whether a take begins with the run.
    """
    bus = LocalNetwork("studio", ManualClock(1)).bus()
    supervisor, text = supervised(take.parent, take if logged else None, bus, status)
    write(take)
    for one in healths:
        bus.publish(HEALTH, one)
    supervisor.receive_rest()
    return supervisor.summary(interrupted=interrupted), text.getvalue()


@pytest.fixture
def take(tmp_path: Path) -> Path:
    return tmp_path / "take.mcap"


def test_the_takes_of_a_run_are_named_with_what_is_lost(take: Path) -> None:
    status, text = summary(take, DONE, health("integrator", "main", log_closed=1, ended=1, **{"sent.universal_bap": 94}))
    assert f"take: {take}: 180 messages, 0 lost" in text
    assert "messages: 95 sent = 90 in the takes + 0 dropped by the queue of the log + 0 never arrived" in text
    assert "5 sent while no take was written" in text
    assert status == DONE


def test_a_take_of_an_earlier_run_or_another_rig_is_none_of_this_run(take: Path) -> None:
    whole(take.with_name("before.mcap"))

    def write(path: Path) -> None:
        whole(path)
        Recording(path.with_name("other.mcap"), rig="other", start_ns=0).close()

    status, text = summary(take, DONE, write=write)
    assert text.count("take: ") == 1
    assert f"take: {take}: 180 messages, 0 lost" in text
    assert status == DONE


def test_a_take_of_another_command_is_named_and_none_of_this_run(take: Path) -> None:
    """That of `zenocap record` was counted too: twice as many messages, and "the integrator was started again"."""

    def write(path: Path) -> None:
        whole(path)
        record_take(path.with_name("recorded.mcap"), 90, "recorder").close()
        cut_off = path.with_name("recovered.mcap")
        record_take(cut_off, 90, "recovered").close()
        cut_off.write_bytes(cut_off.read_bytes()[:-100])

    last = health("integrator", "main", log_closed=1, ended=1, **{"sent.universal_bap": 94})
    status, text = summary(take, DONE, last, write=write)
    assert f"take: {take}: 180 messages, 0 lost" in text
    assert "recorded.mcap: of `zenocap record`, none of this run" in text
    assert "recovered.mcap: of `zenocap recover`, none of this run" in text
    assert "messages: 95 sent = 90 in the takes" in text
    assert text.count("take: ") == 3
    assert status == DONE


def test_a_log_that_stopped_or_whose_file_was_removed_has_lost_messages(take: Path) -> None:
    for counts in ({"log_stopped": 1}, {"log_removed": 1}):
        last = health("integrator", "main", ended=1, **counts, **{"sent.universal_bap": 94})
        status, text = summary(take, DONE, health("integrator", "main"), last)
        assert "180 messages, 5 lost" in text  # four poses and a health
        assert status == LOSS
        take.unlink()
        assert summary(take, DONE, health("viewer", "9", ended=1, **counts))[0] == DONE  # others have no log
        take.unlink()


def test_a_cut_take_has_the_messages_that_can_be_read(take: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    status, text = summary(take, LOSS, write=cut)
    assert "take.mcap: 0 messages" not in text
    assert "messages, an unknown number lost: see the integrator's output; cut: its integrator did not close it" in text
    assert status == LOSS
    assert "reading" not in text
    take.unlink()
    monkeypatch.setattr(shell, "LARGE_BYTES", 1)  # minutes for a take of an hour
    text = summary(take, LOSS, write=cut)[1]
    said = f"take: {take} was not closed, or is damaged: reading its 0.0 GB ...\n"
    assert text.index(said) < text.index(f"take: {take}: ")


def test_a_file_that_was_cut_before_its_first_record_is_a_take_of_the_run(take: Path) -> None:
    def write(path: Path) -> None:
        whole(path.with_name("a.mcap"))
        path.write_bytes(path.with_name("a.mcap").read_bytes()[:40])
        path.with_name("empty.mcap").touch()

    status, text = summary(take, DONE, write=write)
    assert f"take: {take}: 0 messages, 0 lost; cut" in text
    assert "empty.mcap is no MCAP file" in text
    assert status == LOSS


def test_a_service_without_a_last_health_leaves_a_time_without_a_count(take: Path) -> None:
    status, text = summary(take, DONE, health("viewer", "1"))
    assert "0 lost, and an unknown number in 0.0 s" in text
    assert "not counted: what viewer 1 sent from 00:00:00.0 UTC to 00:00:00.0 UTC, after its last report" in text
    assert status == LOSS


def test_the_loss_of_several_takes_is_said_once_and_they_are_in_order(take: Path) -> None:
    def write(path: Path) -> None:
        whole(path)
        with_later = Recording(path.with_name("a-later-one.mcap"), rig="studio", start_ns=0)
        with_later.record(Envelope("zenocap/studio/integrator/bap", UNIVERSAL_BAP, bap(1), 2 * 10**18))
        with_later.close()

    text = summary(take, DONE, write=write)[1]
    assert text.index("take.mcap: 180 messages, 0 lost\n") < text.index("a-later-one.mcap: 1 messages, 0 lost\n")
    assert text.count("takes: 0 lost") == 1


def test_without_a_take_nothing_is_complete(take: Path) -> None:
    status, text = summary(take, DONE, health("integrator", "main"), write=lambda _: None, interrupted=True)
    assert "takes: 1 lost, and an unknown number in" in text
    assert status == LOSS


@pytest.mark.parametrize(("interrupted", "ended"), [(True, INTERRUPTED), (False, DONE)])
def test_an_end_during_the_start_loses_nothing(take: Path, interrupted: bool, ended: int) -> None:
    """It was "an unknown number lost", or "integrator failed; see its output above", where there was none."""
    status, text = summary(take, None, health("viewer", "1"), write=lambda _: None, interrupted=interrupted)
    assert "take: none, the end came before its beginning" in text
    assert "lost" not in text
    assert "failed" not in text
    assert status == ended


def test_ctrl_c_is_the_ordinary_end_of_a_run_that_has_begun(take: Path) -> None:
    last = health("integrator", "main", log_closed=1, ended=1, **{"sent.universal_bap": 90})
    assert summary(take, DONE, last, interrupted=True)[0] == DONE


def test_a_failed_service_is_a_failure(take: Path) -> None:
    assert summary(take, 1)[0] == FAILED
    assert summary(take, DONE, write=lambda _: None, logged=False) == (DONE, NO_POSE)


@pytest.mark.parametrize(
    ("counts", "ended", "line"),
    [
        ({"captured_frames": 9, "frames": 9, "sent.silhouette": 9}, DONE, "frames: 9 captured = 9 processed + "),
        ({"captured_frames": 9, "frames": 8, "sent.silhouette": 8}, LOSS, " + 1 not accounted for; 8 processed"),
        ({"captured_frames": 9, "frames": 9, "sent.silhouette": 8}, LOSS, " + 0 not sendable + 1 not accounted for"),
        ({"frames": 8}, LOSS, "frames of viewer 1: 8 processed of an unknown number"),
    ],
)
def test_a_run_without_a_take_states_its_frames(take: Path, counts: dict[str, int], ended: int, line: str) -> None:
    """Those without a count ended with status 0."""
    for last, status in (({"ended": 1}, ended), ({}, LOSS)):
        healths = health("integrator", "main"), health("viewer", "1", **counts, **last)
        found = summary(take, DONE, *healths, write=lambda _: None, logged=False)
        assert line in found[1]
        assert ("not counted: what viewer 1 captured from " in found[1]) == (not last)
        assert "integrator" not in found[1]
        assert found[0] == status


def test_a_take_that_the_page_has_started_is_named_with_its_loss_where_the_run_has_none(take: Path) -> None:
    """With --no-log its loss was without a word."""
    first = health("integrator", "main")
    last = health("integrator", "main", ended=1, log_messages=180, log_stopped=1, **{"sent.universal_bap": 94})
    status, text = summary(take, DONE, first, last, logged=False)
    assert f"take: {take}: 180 messages, 5 lost" in text
    assert status == LOSS
    take.unlink()
    status, text = summary(take, DONE, first, last, logged=False, write=lambda _: None)
    assert "takes: 95 lost" in text  # its file was removed
    assert status == LOSS


def test_a_program_that_publishes_without_end_does_not_keep_a_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A replay or an impostor at 10 messages/s kept `up` for ever, also after Ctrl-C."""
    now_s = 0.0

    def receive(_: float) -> Envelope:
        nonlocal now_s
        now_s += 0.03
        assert now_s < 60.0
        return Envelope("zenocap/studio/integrator/bap", UNIVERSAL_BAP, bap(1), 1)

    bus = LocalNetwork("studio", ManualClock(1)).bus()
    monkeypatch.setattr(bus, "receive", receive)
    monkeypatch.setattr(shell, "time", Mock(monotonic=lambda: now_s, monotonic_ns=lambda: round(1e9 * now_s)))
    supervised(tmp_path, None, bus)[0].receive_rest()
    assert now_s == pytest.approx(shell.REST_S, abs=0.05)


def test_invalid_messages_at_the_end_hide_no_last_health(take: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It was "an unknown number lost", with status 3."""
    monkeypatch.setattr(inbox, "INVALID_S", -1.0)  # as after many of them
    bus = LocalNetwork("studio", ManualClock(1)).bus()
    supervisor, text = supervised(take.parent, take, bus)
    whole(take)
    bus.publish(HEALTH, health("integrator", "main"))
    bus.forward(HEALTH, HEALTH.at("studio", service="integrator", id="main"), b"invalid")
    bus.publish(HEALTH, health("integrator", "main", log_closed=1, ended=1, **{"sent.universal_bap": 90}))
    supervisor.receive_rest()
    assert supervisor.summary() == DONE
    assert "unknown" not in text.getvalue()


@pytest.mark.parametrize("is_terminal", [True, False])
def test_an_end_is_noticed_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_terminal: bool) -> None:
    """In a terminal it was with the next picture of the table."""
    now_s = 0.0

    def receive(timeout_s: float) -> None:
        nonlocal now_s
        now_s += timeout_s

    bus = LocalNetwork("studio", ManualClock(1)).bus()
    monkeypatch.setattr(bus, "receive", receive)
    monkeypatch.setattr(shell, "time", Mock(monotonic=lambda: now_s))
    supervisor, _ = supervised(tmp_path, None, bus, is_terminal=is_terminal, viewer=None)
    supervisor.run(None, lambda: now_s > 0.55)
    assert now_s <= 0.55 + shell.POLL_S


def test_services_here_end_beside_those_of_other_machines_and_the_integrator_last() -> None:
    """After them, a machine that was frozen kept the end for 10 s."""
    both, ended = Barrier(2), list[str]()

    def stop(is_one: Callable[[str], bool] = lambda _: True) -> None:
        ended.append(" ".join(filter(is_one, ("viewer 1", "integrator"))))
        if len(ended) == 1:
            both.wait(5.0)

    shell.end(Mock(stop=stop), lambda: both.wait(5.0))
    assert ended == ["viewer 1", "viewer 1 integrator"]


def test_losses_are_those_of_all_processes_of_the_rigs_own_services(tmp_path: Path) -> None:
    """They were those of the last process and of strangers, of all kinds, and named "frames dropped"."""
    bus = LocalNetwork("studio", ManualClock(1)).bus()
    supervisor, text = supervised(tmp_path, None, bus, viewer=None)
    for id, process, lost in (("1", 1, 3), ("1", 2, 4), ("stranger", 1, 10)):
        bus.publish(HEALTH, health("viewer", id, process=process, step_errors=lost))
    bus.publish(UNIVERSAL_BAP, bap(1))
    supervisor.run(0.1, lambda: False)
    supervisor.summary()
    assert "lost frames, messages and steps: 7\n" in text.getvalue()


def test_after_a_pause_of_the_launcher_no_time_is_made_up_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A line of status, and a second without a health of each service, followed for each second of the pause."""
    now_s, silent_s = 0.0, list[float]()

    def receive(timeout_s: float) -> None:
        nonlocal now_s
        now_s += timeout_s + (3600.0 if now_s < 2.0 <= now_s + timeout_s else 0.0)

    bus = LocalNetwork("studio", ManualClock(1)).bus()
    monkeypatch.setattr(bus, "receive", receive)
    monkeypatch.setattr(shell, "time", Mock(monotonic=lambda: now_s))
    supervisor, text = supervised(tmp_path, None, bus, viewer=None)
    monkeypatch.setattr(ChildProcesses, "end_silent", lambda _, __, period_s: silent_s.append(period_s))
    supervisor.run(None, lambda: now_s > 3605.0)
    assert 4 <= sum(silent_s) <= 6
    assert text.getvalue().count("\n") == len(silent_s)


def test_a_service_that_closes_after_its_last_health_is_not_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A viewer of a video that took long was killed, and showed it once more."""
    bus, found = LocalNetwork("studio", ManualClock(1)).bus(), list[set[str]]()
    monkeypatch.setattr(shell, "LINE_S", 0.01)
    monkeypatch.setattr(ChildProcesses, "end_silent", lambda _, health_s, __: found.append(set(health_s)))
    supervisor, _ = supervised(tmp_path, None, bus, viewer=None)
    bus.publish(HEALTH, health("integrator", "main"))
    bus.publish(HEALTH, health("viewer", "1", ended=1))
    supervisor.run(None, lambda: bool(found))
    assert found == [{"integrator"}]


def test_members_of_a_mesh_listen_at_no_port_that_the_rig_names(monkeypatch: pytest.MonkeyPatch) -> None:
    rig, ports = demo_rig(), range(20_000, 20_006)
    outputs: dict[str, OutputTable] = {"foxglove": FoxgloveTable(port=20_001), "csv": OutputTable()}
    rig = replace(rig, animator=AnimatorTable(page=PageTable(port=20_000), outputs=outputs))
    options = ZenohOptions("peer", listen=("tcp/0.0.0.0:20003", "tls/[::]:20004#iface=eth0"), multicast_scouting=False)
    assert named_ports(rig, options, None) == {20_000, 20_001, 0, 20_003, 20_004}
    assert named_ports(rig, options, 20_002) == {20_002, 20_001, 0, 20_003, 20_004}
    monkeypatch.setattr("zenocap.common.bus.zenoh_session.PORTS", ports)
    (one, other) = places_of(options, 2, {20_000, 20_001, 20_003, 20_004})
    assert {one.listen[0], *other.listen} == {"tcp/127.0.0.1:20002", "tcp/127.0.0.1:20005"}
    clients = replace(options, mode="client")
    assert places_of(clients, 9, ()) == [clients] * 9  # they listen nowhere
