"""The recogniser as a user runs it: real processes, several rigs, one that cannot run; and as one of a rig's services."""

import re
import signal
import time
from pathlib import Path

import pytest
from recognizer_cases import ACTED, RATE, SECOND, actor_model, angles_of_posture

from common import messages as m
from common.body.anatomy import TEN_PARTS
from common.bus.protocol import Alive, Envelope
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.conversion import angles_by_name
from common.runtime.clock import RealClock
from common.runtime.rig import demo_rig_file
from common.topics import POSTURE, UNIVERSAL_BAP
from services.launcher.mesh import free_ports
from services.recognizer.file import write_model
from services.takes.verify.recompute import verify
from tests.test_system import PATIENCE_S, said, started

pytestmark = pytest.mark.system
START = 1_700_000_000 * SECOND
PACE_S = 0.004  # between poses: a burst of them may be dropped, as it should


def rig_file(folder: Path, name: str) -> Path:
    """The demo's rig under another name, with a recogniser of three postures."""
    text = demo_rig_file().read_text().replace('name = "demo"', f'name = "{name}"')
    text = text.replace("demo-calibration.toml", str(demo_rig_file().with_name("demo-calibration.toml")))
    write_model(folder / "three.postures", actor_model())
    (folder / f"{name}.toml").write_text(text.replace('model = "fifteen"', 'model = "three.postures"'))
    return folder / f"{name}.toml"


def bap(k: int, angles: dict[str, float]) -> m.UniversalBap:
    return m.UniversalBap(
        frame=k, captured_ns=START + round(k * SECOND / RATE), position=(0.0, 1.0, 0.0), angles=angles, scores={}, views={},
        stale=[], lost=[],
    )  # fmt: skip


def until_there(bus: ZenohBus, folder: Path) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        match bus.receive(0.2):
            case Alive(service="recognizer", alive=True):
                return
    raise AssertionError(said(folder))


def test_two_rigs_on_one_recogniser_and_a_third_that_cannot_run_stops_nobody(tmp_path: Path) -> None:
    rigs = [rig_file(tmp_path, name) for name in ("one", "two", "three")]
    places = [f"tcp/127.0.0.1:{port}" for port in free_ports(3)]
    one, two, three = (
        ZenohBus.open(ZenohOptions("peer", listen=(place,), multicast_scouting=False), name, RealClock())
        for name, place in zip(("one", "two", "three"), places, strict=True)
    )
    connect = [word for place in places for word in ("--connect", place)]
    with one, two, three:
        three.declare_alive("recognizer", "main")
        for bus in (one, two):
            bus.subscribe(POSTURE)
            bus.watch_alive()
        with started(["recognizer", *rigs, *connect, "--no-multicast-scouting"], tmp_path) as process:
            for bus in (one, two):
                until_there(bus, tmp_path)
            shown = {"one": ACTED, "two": ACTED[::-1]}
            heard: dict[str, list[str | None]] = {"one": [], "two": []}
            for bus in (one, two):
                frame = 0
                for name in shown[bus.rig]:
                    for row in angles_of_posture(name, 403, 0):
                        bus.publish(UNIVERSAL_BAP, bap(frame, angles_by_name(TEN_PARTS, row)))
                        frame += 1
                        time.sleep(PACE_S)
            end_s = time.monotonic() + PATIENCE_S
            for bus in (one, two):
                while len(heard[bus.rig]) < len(ACTED):
                    assert time.monotonic() < end_s, said(tmp_path)
                    match bus.receive(0.2):
                        case Envelope(message=m.Posture() as posture):
                            heard[bus.rig].append(posture.label)
            assert {rig: tuple(labels) for rig, labels in heard.items()} == shown
            process.send_signal(signal.SIGTERM)
            assert process.wait(30) == 1, said(tmp_path)
    text = said(tmp_path)
    assert "recognizer main of rig three is already running" in text
    assert "rig three: its recogniser has ended; the others go on" in text
    assert "one: squat, " in text
    assert "Traceback" not in text


def test_a_rig_with_a_recogniser_starts_it_and_its_take_is_recomputed(tmp_path: Path) -> None:
    with started(["up", rig_file(tmp_path, "one"), "--recordings", tmp_path, "--seconds", "16"], tmp_path) as process:
        assert process.wait(PATIENCE_S) == 0, said(tmp_path)
    text = said(tmp_path)
    assert re.search(r"recognizer: [\d.]+/s (waiting for|listening)", text)
    assert "Traceback" not in text
    (take,) = tmp_path.glob("one-*.mcap")
    found = verify([take])
    assert found.first is None, found.first
    assert found.different.total() == found.unlogged.total() == 0
    assert not [reason for reason in found.reasons if reason.startswith("recognizer")]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nothing.toml"], "nothing.toml: no such rig"),
        (["one.toml", "--model", "nothing"], "--model = 'nothing': no file nothing; allowed: a file, or a name of: "),
        (["one.toml", "--model", "one.toml"], "one.toml: begins with b"),
        (["one.toml", "one.toml"], "rigs one, one: allowed: rigs of different names"),
    ],
)
def test_what_cannot_run_is_one_line(tmp_path: Path, arguments: list[str], words: str) -> None:
    rig_file(tmp_path, "one")
    with started(["recognizer", *arguments], tmp_path) as process:
        assert process.wait(PATIENCE_S) == 1
    assert words in said(tmp_path)
    assert "Traceback" not in said(tmp_path)
