"""The recognizer as a process: several rigs, one of them invalid; and as a service of a rig."""

import re
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

import pytest
from pythonosc.osc_message import OscMessage

from tests.support.built_messages import built
from tests.support.command_receivers import program, udp_receiver
from tests.support.demo_rigs import written_demo
from tests.support.networks import awaited, listener, mesh
from tests.support.processes import PATIENCE_S, ended, output_of, run, started, verified, wait_until
from tests.support.recognizer_cases import RATE, SECOND, SIMULATED_POSTURES, actor_model, angles_of_posture
from tests.support.session_rigs import SessionRig
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.bus.protocol import Alive, Envelope, Received
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import open_session
from zenocap.common.conversion import angles_by_name
from zenocap.common.runtime.clock import RealClock
from zenocap.common.topics import COMMAND, HEALTH, POSTURE, UNIVERSAL_BAP
from zenocap.services.recognizer.model_file import write_model

pytestmark = pytest.mark.core
START = 1_700_000_000 * SECOND


def rig_file(folder: Path, name: str) -> Path:
    """The demo rig under another name, with a recognizer of three postures."""
    path = written_demo(folder, name=name)
    write_model(folder / "three.postures", actor_model())
    before, _, after = path.read_text().partition("[recognizer.commands")
    text = before + after[after.index("[[viewer]]") :]  # commands of postures that the model does not have
    path.write_text(text.replace('model = "fifteen"', 'model = "three.postures"'))
    return path


def bap(k: int, angles: dict[str, float], captured_ns: int | None = None) -> m.UniversalBap:
    captured_ns = START + round(k * SECOND / RATE) if captured_ns is None else captured_ns
    return built(m.UniversalBap, frame=k, captured_ns=captured_ns, angles=angles)


def publish(bus: ZenohBus, k: int, angles: dict[str, float]) -> None:
    """Publish a pose of long ago, and wait until the recognizer has handled it: messages of a burst may be dropped."""
    bus.publish(UNIVERSAL_BAP, bap(k, angles))
    assert bus.wait_until_handled([("recognizer", "main")], PATIENCE_S)


def poses_of(postures: Sequence[str]) -> list[dict[str, float]]:
    """Angles of the poses of one person who performs postures."""
    return [angles_by_name(TEN_PARTS, row) for name in postures for row in angles_of_posture(name, 405, 0)]


def wait_until_alive(bus: ZenohBus, folder: Path) -> None:
    wait_until(lambda: is_present(bus.receive(0.2)), folder)


def is_present(event: Received | None) -> bool:
    return isinstance(event, Alive) and (event.service, event.alive) == ("recognizer", True)


def test_one_recognizer_serves_two_rigs_despite_a_third_invalid_one(tmp_path: Path) -> None:
    rigs = [rig_file(tmp_path, name) for name in ("one", "two", "three")]
    places = [peer.listen for peer in mesh(3)]
    one, two, three = (
        ZenohBus.open(listener(place), name, RealClock())
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
            performed = {one: SIMULATED_POSTURES, two: SIMULATED_POSTURES[::-1]}
            for bus, names in performed.items():
                for frame, pose in enumerate(poses_of(names)):
                    publish(bus, frame, pose)
            for bus, names in performed.items():
                assert tuple(awaited(bus, m.Posture).label for _ in names) == names
            assert ended(process) == 1, output_of(tmp_path)
    text = output_of(tmp_path)
    assert "recognizer main of rig three is already running" in text
    assert "rig three: its recognizer has stopped; the others continue" in text
    assert "one: squat, " in text
    assert "Traceback" not in text


@pytest.mark.nightly
def test_live_postures_are_commands_and_those_of_a_replay_are_not(tmp_path: Path) -> None:
    """A put, a datagram, a program that fails; then the same poses as recorded long ago."""
    rig = rig_file(tmp_path, "one")
    failing = program(tmp_path, "lights", 'echo "$ZENOCAP_POSTURE is broken" >&2; exit 3')
    clock = RealClock()
    bus_place, lab_place = (peer.listen for peer in mesh(2))
    network = ["--connect", bus_place, "--connect", lab_place, "--no-multicast-scouting"]
    received: list[tuple[str, bytes, int]] = []
    with udp_receiver() as osc, ExitStack() as stack:
        tables = f"""
[recognizer.commands.raise-both-arms]
action = "zenoh"
key = "lab/slides/first"
payload = "both"
[recognizer.commands.squat]
action = "osc"
port = {osc.getsockname()[1]}
address = "/squat"
[recognizer.commands.kick-right]
action = "program"
program = "{failing}"
"""
        model = 'model = "three.postures"'
        rig.write_text(rig.read_text().replace(model, f'{model}\nallowed_programs = ["{failing}"]') + tables)
        lab = stack.enter_context(open_session(listener(lab_place)))
        lab.declare_subscriber(
            "lab/**", lambda sample: received.append((str(sample.key_expr), sample.payload.to_bytes(), clock.now_ns()))
        )
        bus = stack.enter_context(ZenohBus.open(listener(bus_place), "one", clock))
        for topic in (POSTURE, COMMAND, HEALTH):
            bus.subscribe(topic)
        bus.watch_alive()
        process = stack.enter_context(started(["recognizer", rig, *network], tmp_path))
        wait_until_alive(bus, tmp_path)
        poses = poses_of(SIMULATED_POSTURES)
        results: list[m.CommandResult] = []
        postures: list[m.Posture] = []
        counts: dict[str, int] = {}

        def receive(timeout_s: float = 0.2) -> None:
            match bus.receive(timeout_s):
                case Envelope(message=m.CommandResult() as result):
                    results.append(result)
                case Envelope(message=m.Posture() as posture):
                    postures.append(posture)
                case Envelope(message=m.Health(service="recognizer") as health):
                    counts.update(health.counts)

        begin_ns = clock.now_ns()
        for k, pose in enumerate(poses):
            captured_ns = begin_ns + round(k * SECOND / RATE)
            while clock.now_ns() < captured_ns:
                receive((captured_ns - clock.now_ns()) / SECOND)
            bus.publish(UNIVERSAL_BAP, bap(k, pose, captured_ns))
        wait_until(lambda: (receive(), len(results) >= 3 and counts.get("commands_failed") == 1)[1], tmp_path)
        assert [(one.frame, one.posture, one.action, one.target, one.outcome) for one in results] == [
            (0, "raise-both-arms", "zenoh", "lab/slides/first", "done"),
            (1, "squat", "osc", f"127.0.0.1:{osc.getsockname()[1]}/squat", "done"),
            (2, "kick-right", "program", failing, "failed"),
        ]
        assert results[2].error == "exit status 3: kick-right is broken"
        assert (counts["commands_done"], counts["commands_dropped"]) == (2, 0)
        ((key, payload, received_ns),) = received
        assert (key, payload) == ("lab/slides/first", b"both")
        first, posture = results[0], postures[0]
        assert first.captured_ns == posture.captured_ns
        assert first.since_end_ns - first.latency_ns == posture.captured_ns - posture.end_ns
        assert first.since_start_ns - first.latency_ns == posture.captured_ns - posture.start_ns
        assert posture.captured_ns + first.latency_ns <= received_ns + SECOND // 100
        assert OscMessage(osc.recv(1500)).address == "/squat"

        for k, pose in enumerate(poses):
            publish(bus, k, pose)
        wait_until(lambda: (receive(), len(postures) >= 6 and counts.get("commands_old") == 3)[1], tmp_path)
        assert len(results) == 3
        assert len(received) == 1
        assert ended(process) == 0, output_of(tmp_path)
    assert "Traceback" not in output_of(tmp_path)


def test_a_rig_with_a_recognizer_starts_it_and_its_take_verifies(two_view_rig: SessionRig, two_view_take: Path) -> None:
    assert re.search(r"recognizer: [\d.]+/s (waiting for|listening)", output_of(two_view_rig.folder))
    found = verified(two_view_take)
    assert found.different.total() == found.unlogged.total() == 0
    assert not [reason for reason in found.reasons if reason.service and reason.service[0] == "recognizer"]


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nothing.toml"], "nothing.toml: no such rig"),
        (["one.toml", "--model", "nothing"], "--model = 'nothing': no file nothing; allowed: a file, or a name of: "),
        (["one.toml", "--model", "one.toml"], "one.toml: begins with b"),
        (["one.toml", "one.toml"], "rigs one, one: allowed: rigs of different names"),
        (["commands.toml"], "commands.toml: recognizer.commands.wave = 'wave': allowed: 'raise-both-arms', 'squat', "),
        (["program.toml"], "program.toml: recognizer.commands.squat.program = '/no/program': no such program: allowed: "),
    ],
)
def test_an_error_is_one_line(tmp_path: Path, arguments: list[str], words: str) -> None:
    text = rig_file(tmp_path, "one").read_text()
    (tmp_path / "commands.toml").write_text(text + '\n[recognizer.commands.wave]\naction = "zenoh"\nkey = "a"\n')
    text = text.replace("[recognizer]", '[recognizer]\nallowed_programs = ["/no/program"]')
    table = '\n[recognizer.commands.squat]\naction = "program"\nprogram = "/no/program"\n'
    (tmp_path / "program.toml").write_text(text + table)
    status, text = run(tmp_path, "recognizer", *arguments)
    assert status == 1
    assert words in text
