"""Decisions on the frame rate of a rig with a tracker are recomputed from the healths in the take."""

from dataclasses import replace
from pathlib import Path

import pytest

from tests.services.integrator.test_rate_control import health
from zenocap.common import messages as m
from zenocap.common.bus.local import LocalNetwork
from zenocap.common.bus.protocol import Envelope, Tick
from zenocap.common.recording.setup_file import SETUP_FILE, recorded_rig, write_setup
from zenocap.common.recording.writer import Attachment, Recording
from zenocap.common.rig.rig import demo_rig
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.runtime.service import Runner
from zenocap.common.topics import FRAME_RATE, HANDLED, HEALTH, TRACKER_DETAIL
from zenocap.services.integrator.shell import timekeeper_service
from zenocap.tools.verify.recompute import verify

S = 1_000_000_000


@pytest.mark.parametrize("lost_health", [None, 6])
def test_decisions_are_equal_unless_an_input_is_missing(tmp_path: Path, lost_health: int | None) -> None:
    rig = replace(demo_rig(), recognizer=None)
    files = (Attachment(SETUP_FILE, "application/json", write_setup(recorded_rig(rig))),)
    clock = ManualClock(S)
    network = LocalNetwork(rig.name, clock)
    runner = Runner(timekeeper_service(rig), network.bus(), clock)
    runner.subscribe()
    viewers, log = network.bus(), network.bus()
    for topic in (HEALTH, HANDLED, FRAME_RATE, TRACKER_DETAIL):
        log.subscribe(topic, every=True)
    recording = Recording(tmp_path / "a.mcap", rig=rig.name, start_ns=0, attachments=files)
    for second in range(1, 15):
        clock.set(second * S)
        for viewer in rig.viewers:  # every second frame is lost
            counts = {"frames": 8 * second, "dropped_frames": 7 * second, "overrun_frames": 7 * second}
            viewers.publish(HEALTH, health("viewer", viewer.id, second, counts))
        while isinstance(received := runner.bus.receive(), Envelope):
            runner.handle(received)
        runner.handle(Tick(clock.now_ns() + 1000))
        runner.report_handled()
        while isinstance(one := log.receive(), Envelope):
            if not (isinstance(one.message, m.Health) and one.message.captured_ns == (lost_health or -1) * S):
                recording.record(one)
    assert recording.close().failure is None
    found = verify([tmp_path / "a.mcap"])
    key = FRAME_RATE.at(rig.name)
    assert not found.failed
    if lost_health is None:
        assert found.equal[key] >= 2
        assert found.complete
    else:
        assert any("is not in the take" in reason.text for reason in found.reasons)
