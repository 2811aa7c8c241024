"""Delays of the cameras are recomputed from the silhouettes in the take, corrections included."""

from dataclasses import replace
from pathlib import Path
from typing import Never

import pytest

from tests.support.moving_balls import mask_of
from zenocap.common.bus.local import LocalNetwork
from zenocap.common.bus.protocol import Envelope, Tick
from zenocap.common.messages import Silhouette
from zenocap.common.recording.setup_file import SETUP_FILE, recorded_rig, write_setup
from zenocap.common.recording.writer import Attachment, Recording
from zenocap.common.rig.rig import demo_rig
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.runtime.service import Runner
from zenocap.common.topics import CAMERA_DELAYS, FRAME_RATE, HANDLED, SILHOUETTE, TRACKER_DETAIL
from zenocap.common.vision.mask_codec import pack
from zenocap.services.integrator.shell import timekeeper_service
from zenocap.services.integrator.timekeeper import TimekeeperSetup, TimekeeperState
from zenocap.tools.verify.recompute import verify

S, FPS, LATE_S = 1_000_000_000, 20, 0.1


@pytest.mark.nightly
def test_estimates_and_corrections_are_recomputed_with_equal_bytes_also_after_a_restart(tmp_path: Path) -> None:
    rig = replace(demo_rig(), recognizer=None, delays="follow")
    files = (Attachment(SETUP_FILE, "application/json", write_setup(recorded_rig(rig))),)
    clock = ManualClock(S)
    network = LocalNetwork(rig.name, clock)
    runner = Runner(timekeeper_service(rig), network.bus(), clock)
    runner.subscribe()
    viewers, log = network.bus(), network.bus()
    for topic in (SILHOUETTE, HANDLED, FRAME_RATE, TRACKER_DETAIL, CAMERA_DELAYS):
        log.subscribe(topic, every=True)
    recording = Recording(tmp_path / "a.mcap", rig=rig.name, start_ns=0, attachments=files)

    def run(runner: Runner[TimekeeperSetup, TimekeeperState, Never], frames: range) -> None:
        for frame in frames:
            now_ns = S + frame * S // FPS
            clock.set(now_ns)
            for k, viewer in enumerate(rig.viewers):
                region, data = pack(mask_of(viewer.camera, 5.0 + frame / FPS - LATE_S * (k == 1)))
                seen = Silhouette(
                    frame=frame, captured_ns=now_ns, viewer=viewer.id, size=viewer.camera.size, region=region, data=data
                )
                viewers.publish(SILHOUETTE, seen)
            while isinstance(received := runner.bus.receive(), Envelope):
                runner.handle(received)
            if frame % FPS == FPS - 1:
                runner.handle(Tick(clock.now_ns() + 1000))
                runner.report_handled()
            while isinstance(one := log.receive(), Envelope):
                recording.record(one)

    run(runner, range(48 * FPS))
    decided = runner.state.delays.decided
    assert decided is not None
    assert max(decided.applied_ms.values(), default=0.0) > 0
    runner.bus.close()
    restarted = Runner(timekeeper_service(rig), network.bus(), clock)
    restarted.subscribe()
    restarted.handle(
        Envelope(CAMERA_DELAYS.at(rig.name), CAMERA_DELAYS, decided, clock.now_ns())
    )  # as the tracker returns it
    assert restarted.state.delays.decided == decided
    run(restarted, range(48 * FPS, 51 * FPS))
    assert recording.close().failure is None
    found = verify([tmp_path / "a.mcap"])
    assert not found.failed, found.reasons
    assert found.equal[CAMERA_DELAYS.at(rig.name)] >= 3
