"""The integrator as a process: rig in, bus open, log open, run."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Never

from common.body.anatomy import TEN_PARTS
from common.body.limbs import limb_angles, limb_directions
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.runtime.clock import RealClock
from common.runtime.rig import Rig
from common.runtime.service import Service, Subscription, run
from common.runtime.versions import versions
from common.take.log import Log
from common.take.naming import take_path
from common.take.parts import PartLimits, Parts
from common.take.recording import Attachment, Recording
from common.take.setup import SETUP_FILE, RecordedRig, recorded_rig, write_setup
from common.topics import HEALTH, PARTIAL_BAP, PARTIAL_BDP, SIGHTING
from services.integrator.states import Setup, State, integrator_setup
from services.integrator.step import counts, describe, initial_state, step

ID = "main"
LOSS = 3  # exit status: all went well, but the log is not complete


def integrator_service(rig: Rig) -> Service[Setup, State, Never]:
    """The integrator of a rig.  Raises ValueError when its cameras do not suit the method."""
    setup = setup_of(recorded_rig(rig))
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


def setup_of(rig: RecordedRig) -> Setup:
    """The integrator's setup, of a rig or of what a take says of one.  Raises ValueError."""
    return integrator_setup(TEN_PARTS, rig.cameras(), rig.frame_ns(), rig.person_height)


def run_integrator(
    rig: Rig, options: ZenohOptions, take: Path | None, stopped: Callable[[], bool], *, must_log: bool = True
) -> int:
    """Run until `stopped`; take: where the log is written, None for no log.  Returns the exit status.

    must_log: raise RecordingError when the take cannot be opened; else that is said, and the rig tracks without it.
    Raises BusError, RecordingError and ValueError before it runs.
    """
    clock = RealClock()
    service = integrator_service(rig)
    limb_angles(TEN_PARTS, limb_directions(TEN_PARTS, TEN_PARTS.neutral), TEN_PARTS.neutral)  # loads what is compiled
    with ZenohBus.open(options, rig.name, clock, stopped) as bus:
        if take is None:
            return run(service, bus, clock, stopped=stopped)
        log = Log(bus.reader(), new_parts(rig, take, clock.now_ns(), must_open=must_log))
        log.start()
        try:
            status = run(service, bus, clock, stopped=stopped, extra_counts=log.counts)
        finally:
            end = log.close()
    return status or (LOSS if end.lost or end.failure else 0)


def new_parts(rig: Rig, path: Path, start_ns: int, *, must_open: bool = True, limits: PartLimits | None = None) -> Parts:
    """The take of a rig, in parts when the rig or `limits` asks for them.  Raises RecordingError as `Parts` does."""
    files = attachments(rig)

    def open_part(path: Path, start_ns: int, part: Mapping[str, str] | None) -> Recording:
        return new_recording(rig, path, start_ns, part=part, files=files)

    named_by_time = path.name.startswith(f"{rig.name}-")
    return Parts(
        open_part,
        path,
        start_ns,
        PartLimits.of(rig.log.part_mb, rig.log.part_minutes) if limits is None else limits,
        (lambda now_ns: take_path(rig.name, path.parent, now_ns)) if named_by_time else None,
        must_open=must_open,
    )


def new_recording(
    rig: Rig,
    path: Path,
    start_ns: int,
    *,
    overwrite: bool = False,
    part: Mapping[str, str] | None = None,
    files: tuple[Attachment, ...] | None = None,
) -> Recording:
    """A take that carries its rig, its calibration and the versions it was made with.  Raises RecordingError.

    part: metadata of a part of a take.  files: the rig's `attachments`, where they have been read before.
    """
    metadata = {"versions": versions(), "rig": {"name": rig.name, "method": rig.method, "digest": rig.digest}}
    return Recording(
        path,
        rig=rig.name,
        start_ns=start_ns,
        metadata=metadata | ({"part": part} if part else {}),
        attachments=attachments(rig) if files is None else files,
        overwrite=overwrite,
    )


def attachments(rig: Rig) -> tuple[Attachment, ...]:
    """The files of a rig, and what its steps are set up with."""
    setup = Attachment(SETUP_FILE, "application/json", write_setup(recorded_rig(rig)))
    return (*(Attachment(file.name, "text/plain", file.read_bytes()) for file in rig.files), setup)
