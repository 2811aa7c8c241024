"""Log stopped and started on request: messages between are lost, latched ones repeated."""

from pathlib import Path
from typing import Literal

import pytest

from tests.support.animator_stand_in import bap, body_message, pose_at
from tests.support.live_cameras import until
from zenocap.common import messages as m
from zenocap.common.bus.local import LocalNetwork
from zenocap.common.recording.log import Log
from zenocap.common.recording.reader import TakeReader, envelope
from zenocap.common.recording.writer import Recording, RecordingError
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.topics import REQUEST, UNIVERSAL_BAP, UNIVERSAL_BDP
from zenocap.services.integrator.log_control import LogControl

NOW = 1_700_000_000_000_000_000


class Rig:
    """A bus to publish on, and the log control that subscribes to it.  first: with a log from the start."""

    def __init__(self, folder: Path, *, first: bool) -> None:
        self.folder, self.takes, self.now_s = folder, 0, 100.0
        self.network = LocalNetwork("demo", ManualClock(NOW))
        self.bus = self.network.bus()
        log = self.start_log() if first else None
        self.control = LogControl(self.network.bus(), self.start_log, log, lambda: self.now_s)
        self.control.start()

    def start_log(self) -> Log:
        self.takes += 1
        if self.takes > 2:
            raise RecordingError("the disk is full")
        return Log(self.network.bus(), Recording(self.folder / f"{self.takes}.mcap", rig="demo", start_ns=NOW))

    def publish_request(self, what: Literal["record", "stop_recording"], after_s: float = 1.0) -> None:
        """after_s: time since the previous request."""
        self.now_s += after_s
        self.bus.publish(REQUEST, m.Request(frame=0, captured_ns=NOW, what=what))

    def record(self, after_s: float = 1.0) -> None:
        """Request a log and wait for it."""
        self.publish_request("record", after_s)
        self.until(log_on=1)

    def stop(self) -> None:
        """Request the end of the log and wait for it."""
        self.publish_request("stop_recording")
        self.until(log_on=0)

    def publish_pose(self, frame: int) -> None:
        self.bus.publish(UNIVERSAL_BAP, bap(frame, NOW + frame, pose_at(0.0)))

    def until(self, **counts: int) -> None:
        """Wait for these counts."""
        until(lambda: counts.items() <= self.control.counts().items())


def frames_in(path: Path) -> list[int]:
    found = [received.message for recorded in TakeReader(path).messages() if (received := envelope(recorded)) is not None]
    return [message.frame for message in found if isinstance(message, m.UniversalBap)]


@pytest.mark.slow
def test_a_log_is_stopped_and_a_new_one_started(tmp_path: Path) -> None:
    rig = Rig(tmp_path, first=True)
    rig.bus.publish(UNIVERSAL_BDP, body_message(NOW))
    assert rig.control.counts()["log_on"] == 1
    rig.publish_pose(1)
    rig.until(log_messages=2)
    rig.publish_request("stop_recording")
    until(lambda: rig.control.counts() == {"log_on": 0})
    rig.publish_pose(2)
    rig.record()
    rig.publish_pose(3)
    rig.until(log_messages=2)  # the body, latched for late joiners, and the pose
    assert [end.lost for end in rig.control.close()] == [0, 0]
    assert frames_in(tmp_path / "1.mcap") == [1]
    assert frames_in(tmp_path / "2.mcap") == [3]


def test_a_request_for_the_current_state_changes_nothing(tmp_path: Path) -> None:
    rig = Rig(tmp_path, first=False)
    rig.publish_request("stop_recording")
    rig.record()
    rig.publish_request("record")
    rig.publish_pose(1)
    rig.until(log_messages=2)
    rig.control.close()
    assert rig.takes == 1


def test_a_failed_start_is_reported_and_later_requests_are_handled(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    rig = Rig(tmp_path, first=False)
    rig.takes = 2
    rig.publish_request("record")
    until(lambda: "the disk is full" in caplog.text)
    assert rig.control.counts()["log_on"] == 0
    rig.takes = 0
    rig.record()
    rig.control.close()
    assert [path.name for path in tmp_path.glob("*.mcap")] == ["1.mcap"]


@pytest.mark.slow
def test_at_most_one_request_a_second_is_obeyed(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    rig = Rig(tmp_path, first=True)
    rig.stop()
    for number in range(20):
        rig.publish_request("record", 0.04)
        rig.until(log_refused=number + 1)
    assert rig.takes == 1
    assert [record.getMessage() for record in caplog.records if "refused" in record.getMessage()] == [
        "request 'record' refused: at most one start or stop of the log in 1 s is obeyed "
        "(1 since the last such line; at most one every 10 s)"
    ]
    rig.record(0.25)
    assert rig.takes == 2
    rig.control.close()


def test_the_last_counts_are_of_all_logs(tmp_path: Path) -> None:
    rig = Rig(tmp_path, first=True)
    for frame in range(3):
        rig.publish_pose(frame)
    rig.until(log_messages=3)
    rig.stop()
    rig.record()
    rig.publish_pose(3)
    rig.until(log_messages=1)
    rig.control.close()
    counts = dict(rig.control.counts())
    assert counts.pop("log_messages") >= 4  # the poses, and requests that arrived before the end of a log
    assert counts == {"log_closed": 1, "log_on": 0, "log_lost": 0, "log_removed": 0, "log_stopped": 0}
    assert len(rig.control.close()) == 2
