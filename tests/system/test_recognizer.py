"""The recognizer as a process: several rigs, one of them invalid; and as a service of a rig."""

import re
import signal
import time
from pathlib import Path

import pytest

from tests.support.processes import PATIENCE_S, output_of, started
from tests.support.recognizer_cases import RATE, SECOND, SIMULATED_POSTURES, actor_model, angles_of_posture
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.bus.protocol import Alive, Envelope
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.conversion import angles_by_name
from zenocap.common.rig.rig import demo_rig_file
from zenocap.common.runtime.clock import RealClock
from zenocap.common.topics import POSTURE, UNIVERSAL_BAP
from zenocap.services.recognizer.model_file import write_model
from zenocap.tools.launcher.peer_mesh import free_ports
from zenocap.tools.verify.recompute import verify

pytestmark = pytest.mark.system
START = 1_700_000_000 * SECOND
PACE_S = 0.004  # between poses (s): messages of a burst may be dropped


def rig_file(folder: Path, name: str) -> Path:
    """The demo rig under another name, with a recognizer of three postures."""
    text = demo_rig_file().read_text().replace('name = "demo"', f'name = "{name}"')
    text = text.replace("demo-calibration.toml", str(demo_rig_file().with_name("demo-calibration.toml")))
    write_model(folder / "three.postures", actor_model())
    before, _, after = text.partition("[recognizer.commands")
    text = before + after[after.index("[[viewer]]") :]  # commands of postures that the model does not have
    (folder / f"{name}.toml").write_text(text.replace('model = "fifteen"', 'model = "three.postures"'))
    return folder / f"{name}.toml"


def bap(k: int, angles: dict[str, float]) -> m.UniversalBap:
    return m.UniversalBap(
        frame=k, captured_ns=START + round(k * SECOND / RATE), position=(0.0, 1.0, 0.0), angles=angles, scores={}, views={},
        stale=[], lost=[],
    )  # fmt: skip


def wait_until_alive(bus: ZenohBus, folder: Path) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        match bus.receive(0.2):
            case Alive(service="recognizer", alive=True):
                return
    raise AssertionError(output_of(folder))


def test_one_recognizer_serves_two_rigs_despite_a_third_invalid_one(tmp_path: Path) -> None:
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
                wait_until_alive(bus, tmp_path)
            performed = {"one": SIMULATED_POSTURES, "two": SIMULATED_POSTURES[::-1]}
            received: dict[str, list[str | None]] = {"one": [], "two": []}
            for bus in (one, two):
                frame = 0
                for name in performed[bus.rig]:
                    for row in angles_of_posture(name, 403, 0):
                        bus.publish(UNIVERSAL_BAP, bap(frame, angles_by_name(TEN_PARTS, row)))
                        frame += 1
                        time.sleep(PACE_S)
            end_s = time.monotonic() + PATIENCE_S
            for bus in (one, two):
                while len(received[bus.rig]) < len(SIMULATED_POSTURES):
                    assert time.monotonic() < end_s, output_of(tmp_path)
                    match bus.receive(0.2):
                        case Envelope(message=m.Posture() as posture):
                            received[bus.rig].append(posture.label)
            assert {rig: tuple(labels) for rig, labels in received.items()} == performed
            process.send_signal(signal.SIGTERM)
            assert process.wait(30) == 1, output_of(tmp_path)
    text = output_of(tmp_path)
    assert "recognizer main of rig three is already running" in text
    assert "rig three: its recognizer has stopped; the others continue" in text
    assert "one: squat, " in text
    assert "Traceback" not in text


def test_a_rig_with_a_recognizer_starts_it_and_its_take_verifies(tmp_path: Path) -> None:
    with started(["up", rig_file(tmp_path, "one"), "--recordings", tmp_path, "--seconds", "16"], tmp_path) as process:
        assert process.wait(PATIENCE_S) == 0, output_of(tmp_path)
    text = output_of(tmp_path)
    assert re.search(r"recognizer: [\d.]+/s (waiting for|listening)", text)
    assert "Traceback" not in text
    (take,) = tmp_path.glob("one-*.mcap")
    found = verify([take])
    assert found.first is None, found.first
    assert found.different.total() == found.unlogged.total() == 0
    assert not [reason for reason in found.reasons if reason.service and reason.service[0] == "recognizer"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nothing.toml"], "nothing.toml: no such rig"),
        (["one.toml", "--model", "nothing"], "--model = 'nothing': no file nothing; allowed: a file, or a name of: "),
        (["one.toml", "--model", "one.toml"], "one.toml: begins with b"),
        (["one.toml", "one.toml"], "rigs one, one: allowed: rigs of different names"),
    ],
)
def test_an_error_is_one_line(tmp_path: Path, arguments: list[str], words: str) -> None:
    rig_file(tmp_path, "one")
    with started(["recognizer", *arguments], tmp_path) as process:
        assert process.wait(PATIENCE_S) == 1
    assert words in output_of(tmp_path)
    assert "Traceback" not in output_of(tmp_path)
