"""Decisions of the timekeeper, recomputed: frame rate from healths, delays from silhouettes."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from tests.services.integrator.test_rate_control import health
from tests.support.built_messages import silhouette
from tests.support.moving_balls import mask_of
from zenocap.common import messages as m
from zenocap.common.bus.local import LocalNetwork
from zenocap.common.bus.protocol import Envelope, Tick
from zenocap.common.recording.setup_file import SETUP_FILE, recorded_rig, write_setup
from zenocap.common.recording.writer import Attachment, Recording
from zenocap.common.rig.rig import Rig, demo_rig
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.runtime.service import Runner
from zenocap.common.topics import CAMERA_DELAYS, FRAME_RATE, HANDLED, HEALTH, SILHOUETTE, TRACKER_DETAIL
from zenocap.services.integrator.shell import timekeeper_service
from zenocap.tools.takes.verify.recompute import verify

S, FPS, LATE_S = 1_000_000_000, 20, 0.1


class RecordedTimekeeper:
    """A timekeeper of a rig on a local network, and the take of what it receives and publishes."""

    def __init__(self, rig: Rig, path: Path, logged: Callable[[m.Message], bool] = lambda _: True) -> None:
        self.clock, self._rig, self._logged = ManualClock(S), rig, logged
        self._network = LocalNetwork(rig.name, self.clock)
        files = (Attachment(SETUP_FILE, "application/json", write_setup(recorded_rig(rig))),)
        self.recording = Recording(path, rig=rig.name, start_ns=0, attachments=files)
        self.start()
        self.viewers, self._log = self._network.bus(), self._network.bus()
        for topic in (SILHOUETTE, HEALTH, HANDLED, FRAME_RATE, TRACKER_DETAIL, CAMERA_DELAYS):
            self._log.subscribe(topic, every=True)

    def start(self) -> None:
        self.runner = Runner(timekeeper_service(self._rig), self._network.bus(), self.clock)
        self.runner.subscribe()

    def step(self, *, report: bool) -> None:
        """Handle and record what was published."""
        while isinstance(received := self.runner.bus.receive(), Envelope):
            self.runner.handle(received)
        if report:
            self.runner.handle(Tick(self.clock.now_ns() + 1000))
            self.runner.report_handled()
        while isinstance(one := self._log.receive(), Envelope):
            if self._logged(one.message):
                self.recording.record(one)


@pytest.mark.parametrize("lost_health", [None, 6])
def test_decisions_are_equal_unless_an_input_is_missing(tmp_path: Path, lost_health: int | None) -> None:
    rig, path = replace(demo_rig(), recognizer=None), tmp_path / "a.mcap"
    lost_ns = (lost_health or -1) * S
    one = RecordedTimekeeper(rig, path, lambda it: not (isinstance(it, m.Health) and it.captured_ns == lost_ns))
    for second in range(1, 15):
        one.clock.set(second * S)
        for viewer in rig.viewers:  # every second frame is lost
            counts = {"frames": 8 * second, "dropped_frames": 7 * second, "overrun_frames": 7 * second}
            one.viewers.publish(HEALTH, health("viewer", viewer.id, second, counts))
        one.step(report=True)
    assert one.recording.close().failure is None
    found = verify([path])
    assert not found.failed
    if lost_health is None:
        assert found.equal[FRAME_RATE.at(rig.name)] >= 2
        assert found.complete
    else:
        assert any("is not in the take" in reason.text for reason in found.reasons)


@pytest.mark.nightly
def test_estimates_and_corrections_are_recomputed_with_equal_bytes_also_after_a_restart(tmp_path: Path) -> None:
    rig, path = replace(demo_rig(), recognizer=None, delays="follow"), tmp_path / "a.mcap"
    one = RecordedTimekeeper(rig, path)

    def run(frames: range) -> None:
        for frame in frames:
            now_ns = S + frame * S // FPS
            one.clock.set(now_ns)
            for k, viewer in enumerate(rig.viewers):
                mask = mask_of(viewer.camera, 5.0 + frame / FPS - LATE_S * (k == 1))
                one.viewers.publish(SILHOUETTE, silhouette(viewer.id, frame, now_ns, mask))
            one.step(report=frame % FPS == FPS - 1)

    run(range(48 * FPS))
    decided = one.runner.state.delays.decided
    assert decided is not None
    assert max(decided.applied_ms.values(), default=0.0) > 0
    one.runner.bus.close()
    one.start()
    now_ns = one.clock.now_ns()
    one.runner.handle(Envelope(CAMERA_DELAYS.at(rig.name), CAMERA_DELAYS, decided, now_ns))  # as the tracker returns it
    assert one.runner.state.delays.decided == decided
    run(range(48 * FPS, 51 * FPS))
    assert one.recording.close().failure is None
    found = verify([path])
    assert not found.failed, found.reasons
    assert found.equal[CAMERA_DELAYS.at(rig.name)] >= 3
