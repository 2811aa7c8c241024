"""The log has every message of the rig, and a slow disk delays no service."""

import shutil
import threading
from pathlib import Path
from unittest.mock import Mock

import pytest

from tests.common.bus.test_inbox import bap, sighting
from tests.common.bus.test_local import bdp
from zenocap.common.bus import inbox
from zenocap.common.bus.local import LocalNetwork
from zenocap.common.bus.protocol import Envelope
from zenocap.common.recording import log as log_module
from zenocap.common.recording.log import DRAIN_S, DiskSpace, Log, shortage
from zenocap.common.recording.reader import TakeReader
from zenocap.common.recording.writer import Recording
from zenocap.common.runtime.clock import RealClock
from zenocap.common.topics import PARTIAL_BDP, SIGHTING, UNIVERSAL_BAP


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
    take = TakeReader(tmp_path / "take.mcap")
    expected = ["zenocap.PartialBdp", *["zenocap.Sighting", "zenocap.UniversalBap"] * 50]
    assert [recorded.schema for recorded in take.messages()] == expected
    assert (end.messages, end.lost, take.cut) == (101, 0, None)


def test_a_slow_disk_loses_messages_and_reports_them(network, tmp_path, monkeypatch, caplog):
    monkeypatch.setattr(inbox, "MAX_QUEUED", 10)
    bus, disk = network.bus(), threading.Event()
    slow = recording(tmp_path)
    write = slow.record
    monkeypatch.setattr(slow, "record", lambda envelope: (disk.wait(60.0), write(envelope)))
    log = Log(bus.reader(), slow)
    log.start()
    for frame in range(100):
        bus.publish(UNIVERSAL_BAP, bap(frame))
    disk.set()
    end = log.close()
    assert end.messages + end.lost == 100
    assert 80 <= end.lost <= 90
    assert f"{end.lost} lost" in caplog.text


def test_what_a_slow_disk_leaves_in_the_queue_at_the_end_is_lost(network, tmp_path, monkeypatch, caplog):
    """It was in no count: "0 lost", and the exit status was 0."""
    bus, now_s, slow = network.bus(), [0.0], recording(tmp_path)
    write = slow.record
    log = Log(bus.reader(), slow)

    def record(envelope: Envelope) -> None:
        log._closing.wait(60.0)
        now_s[0] += DRAIN_S / 2
        write(envelope)

    monkeypatch.setattr(slow, "record", record)
    monkeypatch.setattr(log_module, "monotonic", lambda: now_s[0])
    log.start()
    for frame in range(20):
        bus.publish(UNIVERSAL_BAP, bap(frame))
    end = log.close()
    take = TakeReader(tmp_path / "take.mcap")
    assert (len(list(take.messages())), take.cut) == (end.messages, None)
    assert (end.messages + end.lost, end.incomplete) == (20, True)
    assert f"{end.lost} of them still in the queue at the end" in caplog.text


def test_invalid_messages_at_the_end_hide_no_valid_one_behind_them(network, tmp_path, monkeypatch):
    monkeypatch.setattr(inbox, "INVALID_S", -1.0)  # as after many of them
    bus, one = network.bus(), recording(tmp_path)
    write = one.record
    log = Log(bus.reader(), one)
    monkeypatch.setattr(one, "record", lambda envelope: (log._closing.wait(60.0), write(envelope)))
    log.start()
    bus.publish(UNIVERSAL_BAP, bap(0))
    bus.forward(UNIVERSAL_BAP, UNIVERSAL_BAP.on("studio"), b"invalid")
    bus.publish(UNIVERSAL_BAP, bap(1))
    end = log.close()
    assert (end.messages, end.lost) == (2, 0)


def test_a_disk_that_does_not_respond_at_the_end_is_a_failure(network, tmp_path, monkeypatch):
    """The exit status was 0."""
    monkeypatch.setattr(log_module, "DRAIN_S", 0.01)
    bus, disk, hung, hangs = network.bus(), threading.Event(), recording(tmp_path), threading.Event()
    monkeypatch.setattr(hung, "record", lambda _: (hangs.set(), disk.wait(60.0)))
    log = Log(bus.reader(), hung)
    log.start()
    for frame in range(5):
        bus.publish(UNIVERSAL_BAP, bap(frame))
    assert hangs.wait(60.0)
    end = log.close()
    assert "the disk does not respond" in end.failure
    assert (end.lost, log.counts()["log_stopped"]) == (4, 1)
    disk.set()


def test_a_full_disk_ends_the_log_and_not_the_rig(network, tmp_path, monkeypatch):
    bus = network.bus()
    log = Log(bus.reader(), recording(tmp_path))
    monkeypatch.setattr("os.fsync", Mock(side_effect=OSError(28, "No space left on device")))
    log.start()
    bus.publish(UNIVERSAL_BAP, bap(0))
    end = log.close()
    assert "No space left on device" in end.failure
    bus.publish(UNIVERSAL_BAP, bap(1))


@pytest.mark.parametrize(
    ("free", "rate", "words"),
    [
        (10**12, 1e6, None),
        (2 * 10**9, 0.0, None),
        (5 * 10**8, 0.0, "the disk is nearly full: 500 MB free"),
        (5 * 10**8, 1e6, "the disk is nearly full: 500 MB free, 8 minutes at the current rate"),
        (3 * 10**9, 1e7, "the disk is nearly full: 3000 MB free, 5 minutes at the current rate"),
    ],
)
def test_less_than_a_gigabyte_or_ten_minutes_gives_a_warning(free: int, rate: float, words: str | None) -> None:
    assert shortage(free, rate) == words


def test_the_warning_is_logged_once_until_there_is_space_again(tmp_path, monkeypatch, caplog):
    space = DiskSpace(tmp_path)
    for free, warnings in ((10**12, 0), (10**6, 1), (10**5, 1), (10**12, 1), (10**6, 2)):
        monkeypatch.setattr(shutil, "disk_usage", lambda _, free=free: Mock(free=free))
        space.check(0.0)
        assert space.free_bytes == free
        assert caplog.text.count("nearly full") == warnings


def test_free_space_of_a_missing_folder_is_none(tmp_path: Path) -> None:
    space = DiskSpace(tmp_path / "gone")
    space.check(1.0)
    assert space.free_bytes is None
