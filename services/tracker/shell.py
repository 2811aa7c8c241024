"""The tracker process: read the rig, open the bus, run."""

import logging
import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Never, TypeVar

from msgspec import UNSET

from zenocap.common import topics as t
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.messages import TrackerPose
from zenocap.common.recording.setup_file import PRIOR_FILE, RecordedRig, checked_attachment, recorded_rig
from zenocap.common.rig.methods import method_of
from zenocap.common.rig.rig import Rig
from zenocap.common.rig.services import services_of
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.compiled import compiling
from zenocap.common.runtime.service import Service, TopicSubscription, new_pose_service, run
from zenocap.common.runtime.service_info import service_info
from zenocap.common.runtime.signals import loading
from zenocap.common.vision.threads import use_one_thread
from zenocap.services.tracker.filter.particles import REFINEMENTS
from zenocap.services.tracker.jit_warmup import load_compiled
from zenocap.services.tracker.prior.file import parse_prior, read_prior
from zenocap.services.tracker.prior.model import Prior
from zenocap.services.tracker.states import METHODS, Options, TrackerSetup, TrackerState, Turn
from zenocap.services.tracker.step import awaiting_person, counts, describe, initial_state, pending, phase_of, step

logger = logging.getLogger(__name__)
Name = TypeVar("Name", bound=str)

ID = "main"


def tracker_service(rig: Rig) -> Service[TrackerSetup, TrackerState, Never]:
    """Service of a rig's tracker.  Raises ValueError for a method without one, UserError and OSError for its prior."""
    recorded = recorded_rig(rig)
    prior = None if rig.tracker is None or rig.tracker.prior is None else read_prior(rig.tracker.prior, recorded.anatomy())
    return service_of(setup_of(recorded, prior))


def service_of(setup: TrackerSetup) -> Service[TrackerSetup, TrackerState, Never]:
    """Service of a tracker."""
    topics = (
        TopicSubscription(t.SILHOUETTE, every=True),
        TopicSubscription(t.CAMERA),
        TopicSubscription(t.FRAME_RATE),
        TopicSubscription(t.TRACKER_DETAIL),
        TopicSubscription(t.CAMERA_DELAYS),
        TopicSubscription(t.TRACKER_BDP),
        TopicSubscription(t.HEALTH, names={"service": "viewer"}),
        TopicSubscription(t.REQUEST),
    )
    return Service(
        "tracker", ID, setup, partial(initial_state, setup), step, topics, describe, counts, phase_of,
        pending=pending,
        recovers=lambda state: (t.TRACKER_BDP, t.TRACKER_POSE) if awaiting_person(state) else (),
        result=TrackerPose,
        load=lambda: _load(setup),
    )  # fmt: skip


def _load(setup: TrackerSetup) -> None:
    with compiling(logger, "tracker-service", "tracker"):
        load_compiled(setup)


def setup_of(rig: RecordedRig, prior: Prior | None) -> TrackerSetup:
    """Setup of the tracker from a rig, or from that recorded in a take.  Raises ValueError."""
    if rig.tracker is None:
        raise ValueError(f"method {rig.method!r} has no tracker")
    options = Options(
        method=_one_of(METHODS, method_of(rig.method).tracker_method, "method", " with a tracker"),
        particles=rig.tracker.particles,
        points=rig.tracker.points,
        iterations=rig.tracker.iterations,
        seed=rig.tracker.seed,
        refinement=_one_of(REFINEMENTS, rig.tracker.refinement, "tracker.refinement"),
        filter=rig.tracker.filter,
        front=rig.tracker.front or None,
        heading=None if rig.tracker.heading is UNSET else math.radians(rig.tracker.heading),
        turns=tuple(Turn(one.captured_ns, one.front) for one in rig.tracker.turns or ()),
    )
    if options.front is not None and options.front not in {viewer.id for viewer in rig.viewers}:
        raise ValueError(f"tracker.front = {options.front!r}: allowed: {', '.join(viewer.id for viewer in rig.viewers)}")
    follow = rig.delays == "follow"
    delays_ns = {viewer.id: viewer.delay_ns for viewer in rig.viewers if viewer.delay_ns is not UNSET}
    return TrackerSetup(rig.anatomy(), rig.cameras(), rig.frame_ns(), prior, options, rig.person_height, follow, delays_ns)


def prior_in(rig: RecordedRig, path: Path, attached: bytes | None) -> Prior | None:
    """Prior recorded in a take.  path: of the take.  Raises UserError when missing, ValueError when it differs."""
    digest = rig.tracker.prior_sha256 if rig.tracker else None
    content = checked_attachment(path, PRIOR_FILE, attached, digest)
    return None if content is None else parse_prior(path / PRIOR_FILE, content, rig.anatomy())


def run_tracker(rig: Rig, options: ZenohOptions, stopped: Callable[[], bool]) -> int:
    """Run until `stopped`; returns the exit status.  Raises BusError, UserError, OSError and ValueError at start."""
    use_one_thread()
    clock = RealClock()
    service = new_pose_service(method_of(rig.method), rig)
    with loading(stopped):
        service.load()
    with ZenohBus.open(options, rig.name, clock, stopped, services_of(rig)) as bus:
        bus.serve_service_info(service_info(rig, "tracker", ID, clock.now_ns()))
        return run(service, bus, clock, stopped=stopped)


def _one_of(allowed: tuple[Name, ...], text: str, key: str, where: str = "") -> Name:
    for name in allowed:
        if name == text:
            return name
    raise ValueError(f"{key} = {text!r}: allowed{where}: {', '.join(allowed)}")
