"""A recorder writes what is said on the network, of one rig or of several, and is seen itself."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from typer.testing import CliRunner

from common import messages as m
from common.bus.protocol import BusError, Envelope
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions, open_session
from common.runtime.clock import RealClock
from common.runtime.rig import RigError, demo_rig_file
from common.take.parts import PartLimits
from common.take.reading import Take
from common.topics import HEALTH, PARTIAL_BDP, SIGHTING, TOPICS, UNIVERSAL_BAP, Topic
from services.cli import app
from services.takes.record import Wanted, own_id, run_recorder, topics_named, wanted
from tests.rig_process import bdp
from tests.test_inbox import bap, sighting
from tests.test_zenoh_bus import free_endpoint

PATIENCE_S = 20.0
ROOT = Path(__file__).parents[1]


@pytest.fixture
def routed() -> Iterator[ZenohOptions]:
    endpoint = free_endpoint()
    with open_session(ZenohOptions("router", listen=(endpoint,), multicast_scouting=False)):
        yield ZenohOptions("client", connect=(endpoint,), multicast_scouting=False)


def until(what: Callable[[], bool]) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not what():
        assert time.monotonic() < end_s
        time.sleep(0.01)


class Recorder(threading.Thread):
    """A recorder in a thread."""

    def __init__(self, text: str, options: ZenohOptions, take: Path, topics: tuple[Topic, ...], id: str) -> None:
        super().__init__(daemon=True)
        self._arguments = (wanted(text), options, take, id, topics, PartLimits())
        self.stop = threading.Event()
        self.messages = -1
        self.status: int | None = None

    def run(self) -> None:
        def show(progress: object) -> None:
            self.messages = getattr(progress, "messages", -1)

        self.status = run_recorder(*self._arguments, self.stop.is_set, show)


@contextmanager
def recording(
    text: str,
    options: ZenohOptions,
    take: Path,
    *,
    topics: tuple[Topic, ...] = TOPICS,
    id: str = "here",
) -> Iterator[Recorder]:
    recorder = Recorder(text, options, take, topics, id)
    recorder.start()
    until(lambda: recorder.messages >= 0 or not recorder.is_alive())
    try:
        yield recorder
    finally:
        recorder.stop.set()
        recorder.join(PATIENCE_S)


def keys(take: Path) -> list[str]:
    read = Take(take)
    found = [recorded.topic for recorded in read.messages() if recorded.topic.startswith("zenocap/")]
    assert read.cut is None
    return found


@pytest.mark.system
def test_a_rig_is_recorded_with_what_was_said_before(routed: ZenohOptions, tmp_path: Path) -> None:
    with ZenohBus.open(routed, "studio", RealClock()) as bus:
        bus.publish(PARTIAL_BDP, bdp("1"))
        bus.subscribe(HEALTH, service="recorder")
        heard: list[m.Message] = []

        def recorder_is_seen() -> bool:
            event = bus.receive(0.05)
            if isinstance(event, Envelope):
                heard.append(event.message)
            return any(isinstance(each, m.Health) and each.counts["log_messages"] >= 11 for each in heard)

        with recording("studio", routed, tmp_path / "take.mcap") as recorder:
            for frame in range(10):
                bus.publish(SIGHTING, sighting("1", frame))
            until(recorder_is_seen)
        assert recorder.status == 0
    said = keys(tmp_path / "take.mcap")
    assert said.count("zenocap/studio/viewer/1/bdp") == 1
    assert said.count("zenocap/studio/viewer/1/sighting") == 10
    assert "zenocap/studio/recorder/here/health" in said
    take = Take(tmp_path / "take.mcap")
    assert list(take.messages())
    assert take.metadata["recorder"] == {"id": "here", "expression": "zenocap/studio/**"}


@pytest.mark.system
def test_an_expression_records_several_rigs_and_no_more(routed: ZenohOptions, tmp_path: Path) -> None:
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
            until(lambda: recorder.messages >= 3)
        assert recorder.status == 0
    assert sorted(keys(tmp_path / "take.mcap")) == [
        "zenocap/lab/viewer/2/bdp",
        "zenocap/lab/viewer/2/sighting",
        "zenocap/studio/viewer/1/sighting",
    ]


@pytest.mark.system
def test_two_recorders_need_two_ids_and_take_the_topics_asked_for(routed: ZenohOptions, tmp_path: Path) -> None:
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
        until(lambda: one.messages == 1 and two.messages >= 2)
    assert (one.status, two.status) == (0, 0)
    assert keys(tmp_path / "a.mcap") == ["zenocap/studio/integrator/bap"]
    assert "zenocap/studio/viewer/1/sighting" in keys(tmp_path / "b.mcap")


@pytest.mark.system
def test_silence_is_a_failure(routed: ZenohOptions, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with recording("zenocap/*/integrator/bap", routed, tmp_path / "take.mcap") as recorder:
        pass
    assert recorder.status == 1
    assert "nothing was heard under zenocap/*/integrator/bap" in caplog.text


@pytest.mark.system
@pytest.mark.parametrize("expression", ["zenocap/studio", "robot/**", "zenocap//bap", "zenocap/*/viewer/*/recipes"])
def test_an_expression_without_a_key_of_ours_is_refused(routed: ZenohOptions, expression: str) -> None:
    with ZenohBus.open(routed, "studio", RealClock()) as bus, pytest.raises(BusError, match=r"no key"):
        bus.listener(expression)


@pytest.mark.system
def test_the_command_finishes_the_file_on_ctrl_c(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    arguments = ["studio", "-o", "takes/", "-l", endpoint, "--no-multicast-scouting", "--id", "x", "--part-minutes", "5"]
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "services.cli", "record", *arguments],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        folder = tmp_path / "takes"
        until(lambda: folder.is_dir() and any(folder.iterdir()))
        options = ZenohOptions("client", connect=(endpoint,), multicast_scouting=False)
        with ZenohBus.open(options, "studio", RealClock()) as bus:
            bus.subscribe(HEALTH, service="recorder")
            until(lambda: isinstance(bus.receive(0.1), Envelope))
            bus.publish(UNIVERSAL_BAP, bap(0))
            until(lambda: isinstance(bus.receive(0.1), Envelope))
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE_S)
    finally:
        process.kill()
    assert process.returncode == 0, err
    (take,) = (tmp_path / "takes").glob("studio-*.mcap")
    assert "zenocap/studio/integrator/bap" in keys(take)
    assert "Traceback" not in err


def test_what_is_recorded_may_be_a_file_a_name_or_keys() -> None:
    demo = wanted(str(demo_rig_file()))
    assert (demo.expression, demo.rig) == ("zenocap/demo/**", "demo")
    assert demo.file is not None
    assert wanted("studio") == Wanted("zenocap/studio/**", "studio")
    assert wanted("zenocap/studio/viewer/*/bap") == Wanted("zenocap/studio/viewer/*/bap", "studio")
    assert wanted("zenocap/*/viewer/**") == Wanted("zenocap/*/viewer/**", None)
    assert wanted("**").name == "rigs"
    for text in ("studio.toml", "a b", ""):
        with pytest.raises(RigError):
            wanted(text)


def test_topics_have_names() -> None:
    assert topics_named(["sighting", "health", "sighting"]) == (SIGHTING, HEALTH)
    assert topics_named([]) == TOPICS
    with pytest.raises(RigError, match=r"--topics poses: allowed: partial_bdp, "):
        topics_named(["poses"])


def test_a_machines_name_becomes_plain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("socket.gethostname", lambda: "Ana's laptop.local")
    assert own_id() == "Ana-s-laptop.local"


def test_wrong_words_are_said_in_one_line() -> None:
    for arguments, status in ((["none.toml"], 1), (["studio", "--id", "a b"], 2), (["studio", "--topics", "x"], 1)):
        result = CliRunner().invoke(app, ["record", *arguments])
        assert result.exit_code == status, result.output
