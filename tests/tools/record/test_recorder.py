"""A recorder writes the messages of one rig or several, and is itself visible on the network."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.common.bus.test_inbox import bap, sighting
from tests.support.command import zenocap
from tests.support.live_cameras import until
from tests.support.networks import free_endpoint, router
from tests.support.processes import PATIENCE_S, ended, output_of, started, wait_until
from tests.support.rig_process import bdp
from zenocap.common import messages as m
from zenocap.common.bus.protocol import BusError, Envelope
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions, open_session
from zenocap.common.errors import UserError
from zenocap.common.recording.parts import PartLimits
from zenocap.common.recording.reader import TakeReader
from zenocap.common.rig.rig import demo_rig_file
from zenocap.common.runtime.clock import RealClock
from zenocap.common.topics import HEALTH, PARTIAL_BDP, SIGHTING, TOPICS, UNIVERSAL_BAP, Topic
from zenocap.tools.record.recorder import RecordingSelection, own_id, parse_selection, run_recorder, topics_named


@pytest.fixture
def routed() -> Iterator[ZenohOptions]:
    with router(free_endpoint()) as options:
        yield options


class Recorder(threading.Thread):
    """A recorder in a thread."""

    def __init__(self, text: str, options: ZenohOptions, take: Path, topics: tuple[Topic, ...], id: str) -> None:
        super().__init__(daemon=True)
        self._arguments = (parse_selection(text), options, take, id, topics, PartLimits())
        self.stop = threading.Event()
        self.messages = -1
        self.status: int | None = None

    def run(self) -> None:
        def show(progress: object) -> None:
            self.messages = getattr(progress, "messages", -1)

        self.status = run_recorder(*self._arguments, self.stop.is_set, show)


@contextmanager
def recording(text: str, options: ZenohOptions, take: Path, *, topics=TOPICS, id: str = "here") -> Iterator[Recorder]:
    recorder = Recorder(text, options, take, topics, id)
    recorder.start()
    until(lambda: recorder.messages >= 0 or not recorder.is_alive(), "the recorder begins")
    try:
        yield recorder
    finally:
        recorder.stop.set()
        recorder.join(PATIENCE_S)


def keys(take: Path) -> list[str]:
    reader = TakeReader(take)
    found = [recorded.topic for recorded in reader.messages() if recorded.topic.startswith("zenocap/")]
    assert reader.cut is None
    return found


@pytest.mark.core
def test_recording_contains_latched_messages_from_before_its_start(routed: ZenohOptions, tmp_path: Path) -> None:
    with ZenohBus.open(routed, "studio", RealClock()) as bus:
        bus.publish(PARTIAL_BDP, bdp("1"))
        bus.subscribe(HEALTH, service="recorder")
        received: list[m.Message] = []

        def all_messages_are_logged() -> bool:
            event = bus.receive(0.05)
            if isinstance(event, Envelope):
                received.append(event.message)
            return any(isinstance(each, m.Health) and each.counts["log_messages"] >= 11 for each in received)

        with recording("studio", routed, tmp_path / "take.mcap") as recorder:
            for frame in range(10):
                bus.publish(SIGHTING, sighting("1", frame))
            until(all_messages_are_logged, "all messages in the log")
        assert recorder.status == 0
    recorded = keys(tmp_path / "take.mcap")
    assert recorded.count("zenocap/studio/viewer/1/bdp") == 1
    assert recorded.count("zenocap/studio/viewer/1/sighting") == 10
    assert "zenocap/studio/recorder/here/health" in recorded
    take = TakeReader(tmp_path / "take.mcap")
    assert list(take.messages())
    assert take.metadata["recorder"] == {"id": "here", "expression": "zenocap/studio/**"}


@pytest.mark.core
def test_key_expression_records_only_matching_keys_of_several_rigs(routed: ZenohOptions, tmp_path: Path) -> None:
    with (
        ZenohBus.open(routed, "studio", RealClock()) as studio,
        ZenohBus.open(routed, "lab", RealClock()) as lab,
        open_session(routed) as other,
    ):
        lab.publish(PARTIAL_BDP, bdp("2"))
        with recording("zenocap/*/viewer/**", routed, tmp_path / "take.mcap") as recorder:
            other.put("zenocap/lab/viewer/2/sighting", b"no message")
            for bus, viewer in ((studio, "1"), (lab, "2")):
                bus.publish(UNIVERSAL_BAP, bap(0))
                bus.publish(SIGHTING, sighting(viewer, 0))
            until(lambda: recorder.messages >= 3, "the messages of both rigs")
        assert recorder.status == 0
    assert sorted(keys(tmp_path / "take.mcap")) == [
        "zenocap/lab/viewer/2/bdp",
        "zenocap/lab/viewer/2/sighting",
        "zenocap/studio/viewer/1/sighting",
    ]


@pytest.mark.core
def test_recorders_need_unique_ids_and_record_only_the_requested_topics(routed: ZenohOptions, tmp_path: Path) -> None:
    with (
        ZenohBus.open(routed, "studio", RealClock()) as bus,
        recording("studio", routed, tmp_path / "a.mcap", topics=(UNIVERSAL_BAP,), id="a") as one,
        recording("studio", routed, tmp_path / "b.mcap", topics=(SIGHTING, HEALTH), id="b") as two,
    ):
        with recording("studio", routed, tmp_path / "c.mcap", id="a") as third:
            third.join(PATIENCE_S)
            assert third.status == 1
        bus.publish(UNIVERSAL_BAP, bap(0))
        bus.publish(SIGHTING, sighting("1", 0))
        until(lambda: one.messages == 1 and two.messages >= 2, "the messages of both topics")
    assert (one.status, two.status) == (0, 0)
    assert keys(tmp_path / "a.mcap") == ["zenocap/studio/integrator/bap"]
    assert "zenocap/studio/viewer/1/sighting" in keys(tmp_path / "b.mcap")


@pytest.mark.core
def test_recording_without_any_message_fails(routed, tmp_path, caplog):
    with recording("zenocap/*/integrator/bap", routed, tmp_path / "take.mcap") as recorder:
        pass
    assert recorder.status == 1
    assert "no message received under zenocap/*/integrator/bap" in caplog.text


@pytest.mark.core
@pytest.mark.parametrize("expression", ["zenocap/studio", "robot/**", "zenocap//bap", "zenocap/*/viewer/*/recipes"])
def test_expression_without_a_key_of_any_topic_is_rejected(routed: ZenohOptions, expression: str) -> None:
    with ZenohBus.open(routed, "studio", RealClock()) as bus, pytest.raises(BusError, match=r"no key"):
        bus.listener(expression)


@pytest.mark.nightly
def test_the_command_finishes_the_file_on_ctrl_c(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    arguments = ["studio", "-o", "takes/", "-l", endpoint, "--no-multicast-scouting", "--id", "x", "--part-minutes", "5"]
    with started(["record", *arguments], tmp_path) as process:
        wait_until(lambda: any(tmp_path.glob("takes/*")), tmp_path)
        options = ZenohOptions("client", connect=(endpoint,), multicast_scouting=False)
        with ZenohBus.open(options, "studio", RealClock()) as bus:
            bus.subscribe(HEALTH, service="recorder")
            until(lambda: isinstance(bus.receive(0.1), Envelope), "a health of the recorder")
            bus.publish(UNIVERSAL_BAP, bap(0))
            until(lambda: isinstance(bus.receive(0.1), Envelope), "a health after the message")
        assert ended(process, signal.SIGINT) == 0, output_of(tmp_path)
    (take,) = tmp_path.glob("takes/studio-*.mcap")
    assert "zenocap/studio/integrator/bap" in keys(take)
    assert "Traceback" not in output_of(tmp_path)


def test_recording_is_selected_by_rig_file_rig_name_or_key_expression() -> None:
    demo = parse_selection(str(demo_rig_file("two-view")))
    assert (demo.expression, demo.rig, demo.file is None) == ("zenocap/demo/**", "demo", False)
    assert parse_selection("studio") == RecordingSelection("zenocap/studio/**", "studio")
    for text, rig in (("zenocap/studio/viewer/*/bap", "studio"), ("zenocap/*/viewer/**", None)):
        assert parse_selection(text) == RecordingSelection(text, rig)
    assert parse_selection("**").name == "rigs"
    for text in ("studio.toml", "a b", ""):
        with pytest.raises(UserError):
            parse_selection(text)


def test_topics_are_selected_by_name() -> None:
    assert topics_named(["sighting", "health", "sighting"]) == (SIGHTING, HEALTH)
    assert topics_named([]) == TOPICS
    with pytest.raises(UserError, match=r"--topics poses: allowed: partial_bdp, "):
        topics_named(["poses"])


def test_host_name_becomes_a_valid_recorder_id(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("socket.gethostname", lambda: "Ana's laptop.local")
    assert own_id() == "Ana-s-laptop.local"


@pytest.mark.slow
def test_invalid_arguments_exit_with_an_error_status() -> None:
    for arguments, status in ((["none.toml"], 1), (["studio", "--id", "a b"], 2), (["studio", "--topics", "x"], 1)):
        assert zenocap("record", *arguments)[0] == status
