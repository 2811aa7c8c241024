"""The integrator's log in a real process: write errors, and a kill."""

import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.support.demo_rigs import written_demo
from tests.support.networks import free_endpoint, listener
from tests.support.places import ROOT
from tests.support.processes import PATIENCE_S, ZENOCAP, all_run, ended, output_of, started, wait_for_frames, wait_until
from tests.support.rig_process import sighting
from tests.support.small_disk import small_disk
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Envelope
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.recording.reader import TakeReader
from zenocap.common.rig.rig import demo_rig_file
from zenocap.common.runtime.clock import RealClock
from zenocap.common.topics import ASSIGNMENT, HEALTH, SIGHTING
from zenocap.services.recognizer.model_file import find_model
from zenocap.tools.takes.recover import recover

pytestmark = pytest.mark.nightly
LOSS_NS = 3_000_000_000  # at most, of a log that is written every second
MODEL_KB = find_model("fifteen").stat().st_size // 1000  # a take begins with the posture model


@pytest.fixture
def endpoint() -> str:
    return free_endpoint()


def rig_with_log(folder: Path, log: str) -> Path:
    """The demo's rig, with its own [log] table."""
    return written_demo(folder, f"[log]\n{log}\n")


@contextmanager
def integrator(*arguments: object, endpoint: str) -> Iterator[subprocess.Popen[str]]:
    command = [*ZENOCAP, "integrator", *map(str, arguments), "-e", endpoint, "--no-multicast-scouting"]
    with subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def exchange_messages(bus: ZenohBus, seconds: float, frame: int = 0) -> list[m.Message]:
    """Publish the messages of two viewers at 30 frames/s, and return the received messages."""
    received: list[m.Message] = []
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s:
        for viewer in ("1", "2"):
            bus.publish(SIGHTING, sighting(viewer, frame, time.time_ns()))
        frame += 1
        if isinstance(event := bus.receive(1 / 30), Envelope):
            received.append(event.message)
    return received


def listening_bus(endpoint: str) -> ZenohBus:
    bus = ZenohBus.open(listener(endpoint), "demo", RealClock())
    bus.subscribe(ASSIGNMENT, every=True)
    bus.subscribe(HEALTH, service="integrator")
    return bus


def exchange_until(bus: ZenohBus, process: subprocess.Popen[str], count: str, least: int = 1) -> list[m.Message]:
    """Exchange messages until a count of the integrator's health has a value; return all received messages."""
    received: list[m.Message] = []
    end_s = time.monotonic() + PATIENCE_S
    while not any(isinstance(each, m.Health) and each.counts.get(count, 0) >= least for each in received):
        assert time.monotonic() < end_s
        assert process.poll() is None
        received += exchange_messages(bus, 0.5)
    return received


def errors_of(process: subprocess.Popen[str], status: int) -> str:
    """Standard error of a process that ends with a status."""
    _, err = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == status
    assert "Traceback" not in err
    return err


def test_unwritable_folder_stops_the_log_but_not_the_tracking(tmp_path: Path, endpoint: str) -> None:
    (tmp_path / "takes").write_text("no folder")
    rig = rig_with_log(tmp_path, 'folder = "takes"')
    with listening_bus(endpoint) as bus, integrator(rig, endpoint=endpoint) as process:
        received = exchange_until(bus, process, "received", 11)
        assert any(isinstance(each, m.Assignment) for each in received)
        assert all(each.counts["log_stopped"] == 1 for each in received if isinstance(each, m.Health))
        process.send_signal(signal.SIGTERM)
        assert "takes is no folder; the log stops" in errors_of(process, 3)


def test_a_deleted_folder_is_created_again_and_reported(tmp_path: Path, endpoint: str) -> None:
    rig, folder = rig_with_log(tmp_path, 'folder = "takes"'), tmp_path / "takes"
    with listening_bus(endpoint) as bus, integrator(rig, endpoint=endpoint) as process:
        exchange_until(bus, process, "log_messages", 11)
        shutil.rmtree(folder)
        exchange_until(bus, process, "log_removed")
        exchange_messages(bus, 0.5, 10_000)
        process.send_signal(signal.SIGTERM)
        err = errors_of(process, 3)
    assert "was deleted while it was written" in err
    assert "files deleted or moved while they were written: 1" in err
    (take,) = folder.glob("*.mcap")
    assert TakeReader(take).cut is None
    assert any(message.sequence >= 10_000 for message in TakeReader(take).messages())


def test_requested_file_that_cannot_be_written_is_an_error(tmp_path: Path, endpoint: str) -> None:
    (tmp_path / "takes").write_text("no folder")
    with integrator(demo_rig_file("two-view"), "-o", tmp_path / "takes" / "a.mcap", endpoint=endpoint) as process:
        assert "a.mcap cannot be written" in errors_of(process, 1)


def test_kill_during_a_recording_in_parts_loses_at_most_a_second(tmp_path: Path, endpoint: str) -> None:
    rig = rig_with_log(tmp_path, f"part_minutes = {2 / 60}")
    folder = tmp_path / "recordings"
    with listening_bus(endpoint) as bus, integrator(rig, endpoint=endpoint) as process:
        end_s = time.monotonic() + PATIENCE_S
        while len(list(folder.glob("*.mcap"))) < 2:
            assert time.monotonic() < end_s
            exchange_messages(bus, 0.2)
        exchange_messages(bus, 1.3)
        process.kill()
        killed_ns = time.time_ns()
        process.wait()
    takes = {path: TakeReader(path) for path in folder.glob("*.mcap")}
    messages = {path: list(take.messages()) for path, take in takes.items()}
    last = max(takes, key=lambda path: int(takes[path].metadata["part"]["number"]))
    assert [take.cut is None for path, take in takes.items() if path != last] == [True] * (len(takes) - 1)
    assert takes[last].cut is not None
    assert killed_ns - messages[last][-1].log_ns < LOSS_NS
    files = {"demo.toml", "demo-calibration.toml", "parameters.json", "setup.json", "recognizer.postures"}
    assert takes[last].attachments.keys() == files
    found = recover(last, tmp_path / "recovered.mcap")
    assert found.lost
    assert list(TakeReader(tmp_path / "recovered.mcap").messages()) == messages[last]


def test_up_says_what_a_full_disk_has_and_has_not(tmp_path: Path) -> None:
    """It said 0 messages for 9,761, and 0 lost, because it read neither a cut take nor the end of the integrator."""
    with (
        small_disk(tmp_path / "disk", 300 + MODEL_KB) as folder,
        started(["demo", "--method", "two-view", "--no-page", "--recordings", folder], tmp_path) as demo,
    ):
        wait_until(lambda: "recording stopped after" in output_of(tmp_path), tmp_path)
        wait_until(lambda: all_run(tmp_path), tmp_path)
        wait_for_frames(tmp_path, 60)  # of the rig without a log
        assert ended(demo, signal.SIGINT) == 3, output_of(tmp_path)
        (take,) = folder.glob("*.mcap")
        read = sum(1 for _ in TakeReader(take).messages())
    (words,) = [text.split() for text in output_of(tmp_path).splitlines() if text.startswith("take: ")]
    assert words[2:4] == [str(read), "messages,"]
    assert words[5] == "lost;"
    assert words[6:] == ["cut:", "its", "integrator", "did", "not", "close", "it"]
    assert read > 50
    assert int(words[4]) > 50
