"""The integrator as a process: rig in, bus open, log open, run."""

from collections.abc import Callable
from pathlib import Path
from typing import Never

from common.body.anatomy import TEN_PARTS
from common.body.limbs import limb_angles, limb_directions
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.formats.foxglove.converter import Foxglove
from common.runtime.clock import RealClock
from common.runtime.rig import Rig
from common.runtime.service import Service, Subscription, run
from common.runtime.versions import versions
from common.take.log import Log
from common.take.recording import Attachment, Recording, nothing_beside
from common.topics import HEALTH, PARTIAL_BAP, PARTIAL_BDP, SIGHTING
from services.integrator.states import Setup, State, integrator_setup
from services.integrator.step import counts, describe, initial_state, step

ID = "main"
LOSS = 3  # exit status: all went well, but the log is not complete


def integrator_service(rig: Rig) -> Service[Setup, State, Never]:
    """The integrator of a rig.  Raises ValueError when its cameras do not suit the method."""
    cameras = {viewer.id: viewer.camera for viewer in rig.viewers}
    slowest = min(viewer.fps for viewer in rig.viewers)
    setup = integrator_setup(TEN_PARTS, cameras, round(1e9 / slowest), rig.person_height)
    topics = (SIGHTING, PARTIAL_BDP, PARTIAL_BAP)
    return Service(
        "integrator",
        ID,
        setup,
        initial_state(setup),
        step,
        (*(Subscription(topic) for topic in topics), Subscription(HEALTH, names={"service": "viewer"})),
        describe,
        counts,
        keeps_time=True,
    )


def run_integrator(rig: Rig, options: ZenohOptions, take: Path | None, stopped: Callable[[], bool]) -> int:
    """Run until `stopped`; take: where the log is written, None for no log.  Returns the exit status.

    Raises BusError, RecordingError and ValueError before it runs.
    """
    clock = RealClock()
    service = integrator_service(rig)
    limb_angles(TEN_PARTS, limb_directions(TEN_PARTS, TEN_PARTS.neutral), TEN_PARTS.neutral)  # loads what is compiled
    with ZenohBus.open(options, rig.name, clock, stopped) as bus:
        if take is None:
            return run(service, bus, clock, stopped=stopped)
        log = Log(bus.reader(), new_recording(rig, take, clock.now_ns()))
        log.start()
        try:
            status = run(service, bus, clock, stopped=stopped, extra_counts=log.counts)
        finally:
            end = log.close()
    return status or (LOSS if end.lost else 0)


def new_recording(rig: Rig, path: Path, start_ns: int, *, overwrite: bool = False) -> Recording:
    """A take that carries its rig, its calibration and the versions it was made with.  Raises RecordingError."""
    files = tuple(Attachment(file.name, "text/plain", file.read_bytes()) for file in rig.files)
    metadata = {"versions": versions(), "rig": {"name": rig.name, "method": rig.method, "digest": rig.digest}}
    return Recording(
        path,
        rig=rig.name,
        start_ns=start_ns,
        metadata=metadata,
        attachments=files,
        overwrite=overwrite,
        beside=Foxglove(TEN_PARTS, rig.name).beside if rig.log.foxglove else nothing_beside,
    )
