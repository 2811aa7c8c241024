"""The log has everything that was said on the rig, and a slow disk delays nobody."""

import threading
from pathlib import Path

import pytest

from common.bus import inbox
from common.bus.local import LocalNetwork
from common.runtime.clock import RealClock
from common.take.log import Log
from common.take.reading import Take
from common.take.recording import Recording
from common.topics import PARTIAL_BDP, SIGHTING, UNIVERSAL_BAP
from tests.test_inbox import bap, sighting
from tests.test_local import bdp


@pytest.fixture
def network() -> LocalNetwork:
    return LocalNetwork("studio", RealClock())


def recording(path: Path) -> Recording:
    return Recording(path / "take.mcap", rig="studio", start_ns=0)


def test_every_message_is_written(network: LocalNetwork, tmp_path: Path) -> None:
    bus = network.bus()
    bus.publish(PARTIAL_BDP, bdp("1", 0))
    log = Log(bus.reader(), recording(tmp_path))
    log.start()
    for frame in range(50):
        bus.publish(SIGHTING, sighting("1", frame))
        bus.publish(UNIVERSAL_BAP, bap(frame))
    end = log.close()
    take = Take(tmp_path / "take.mcap")
    assert [recorded.schema for recorded in take.messages()] == [
        "zenocap.PartialBdp",
        *["zenocap.Sighting", "zenocap.UniversalBap"] * 50,
    ]
    assert (end.messages, end.lost, take.cut) == (101, 0, None)


def test_a_slow_disk_loses_messages_and_says_so(
    network: LocalNetwork, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(inbox, "MAX_QUEUED", 10)
    bus, disk = network.bus(), threading.Event()
    slow = recording(tmp_path)
    write = slow.record
    monkeypatch.setattr(slow, "record", lambda envelope: (disk.wait(10.0), write(envelope)))
    log = Log(bus.reader(), slow)
    log.start()
    for frame in range(100):
        bus.publish(UNIVERSAL_BAP, bap(frame))
    disk.set()
    end = log.close()
    assert end.messages + end.lost == 100
    assert 80 <= end.lost <= 90
    assert f"{end.lost} lost" in caplog.text


def test_a_full_disk_ends_the_log_and_not_the_rig(
    network: LocalNetwork, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bus = network.bus()
    log = Log(bus.reader(), recording(tmp_path))

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    log.start()
    bus.publish(UNIVERSAL_BAP, bap(0))
    end = log.close()
    assert end.failure is not None
    assert "No space left on device" in end.failure
    bus.publish(UNIVERSAL_BAP, bap(1))
