"""A log that is ended and begun on request: what is said meanwhile is in no take, what is kept is in the new one."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import pytest
from animator_stand_in import bap, body_message, pose_at

from common import messages as m
from common.bus.local import LocalNetwork
from common.runtime.clock import ManualClock
from common.take.log import Log
from common.take.reading import Take, envelope
from common.take.recording import Recording, RecordingError
from common.topics import REQUEST, UNIVERSAL_BAP, UNIVERSAL_BDP
from services.integrator.switch import Switch

NOW = 1_700_000_000_000_000_000


class Rig:
    """A bus to speak on, and a switch that listens.  first: with a log from the start."""

    def __init__(self, folder: Path, *, first: bool) -> None:
        self.folder, self.takes = folder, 0
        self.network = LocalNetwork("demo", ManualClock(NOW))
        self.bus = self.network.bus()
        self.switch = Switch(self.network.bus(), self.begin, self.begin() if first else None)
        self.switch.start()

    def begin(self) -> Log:
        self.takes += 1
        if self.takes > 2:
            raise RecordingError("the disk is full")
        return Log(self.network.bus(), Recording(self.folder / f"{self.takes}.mcap", rig="demo", start_ns=NOW))

    def ask(self, what: Literal["record", "stop_recording"]) -> None:
        self.bus.publish(REQUEST, m.Request(frame=0, captured_ns=NOW, what=what))

    def say(self, frame: int) -> None:
        self.bus.publish(UNIVERSAL_BAP, bap(frame, NOW + frame, pose_at(0.0)))


def until(what: Callable[[], bool]) -> None:
    end_s = time.monotonic() + 20
    while not what():
        assert time.monotonic() < end_s
        time.sleep(0.005)


def frames_in(path: Path) -> list[int]:
    found = [received.message for recorded in Take(path).messages() if (received := envelope(recorded)) is not None]
    return [message.frame for message in found if isinstance(message, m.UniversalBap)]


def test_a_log_is_ended_and_another_begun(tmp_path: Path) -> None:
    rig = Rig(tmp_path, first=True)
    rig.bus.publish(UNIVERSAL_BDP, body_message(NOW))
    assert rig.switch.counts()["log_on"] == 1
    rig.say(1)
    until(lambda: rig.switch.counts().get("log_messages") == 2)
    rig.ask("stop_recording")
    until(lambda: rig.switch.counts() == {"log_on": 0})
    rig.say(2)
    rig.ask("record")
    until(lambda: rig.switch.counts()["log_on"] == 1)
    rig.say(3)
    until(lambda: rig.switch.counts().get("log_messages") == 2)  # the body, kept for late joiners, and the pose
    ends = rig.switch.close()
    assert [end.lost for end in ends] == [0, 0]
    assert frames_in(tmp_path / "1.mcap") == [1]
    assert frames_in(tmp_path / "2.mcap") == [3]


def test_asking_for_what_is_so_changes_nothing(tmp_path: Path) -> None:
    rig = Rig(tmp_path, first=False)
    rig.ask("stop_recording")
    rig.ask("record")
    until(lambda: rig.switch.counts()["log_on"] == 1)
    rig.ask("record")
    rig.say(1)
    until(lambda: rig.switch.counts().get("log_messages") == 2)
    rig.switch.close()
    assert rig.takes == 1


def test_a_log_that_cannot_begin_is_said_and_the_switch_goes_on(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    rig = Rig(tmp_path, first=False)
    rig.takes = 2
    rig.ask("record")
    until(lambda: "the disk is full" in caplog.text)
    rig.takes = 0
    rig.ask("record")
    until(lambda: rig.switch.counts()["log_on"] == 1)
    rig.switch.close()
