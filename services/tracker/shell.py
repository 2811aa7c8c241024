"""The tracker as a process: rig in, bus open, run."""

import hashlib
import logging
from collections.abc import Callable
from pathlib import Path
from typing import Never, get_args

from common.body.anatomy import ANATOMIES, Anatomy
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.messages import TrackerPose
from common.runtime.about import about
from common.runtime.clock import RealClock
from common.runtime.rig import Rig
from common.runtime.service import Service, Subscription, run
from common.take.reading import TakeError
from common.take.setup import PRIOR_FILE, RecordedRig, recorded_rig
from common.topics import CAMERA, HEALTH, REQUEST, SILHOUETTE, TRACKER_BDP, TRACKER_POSE
from services.tracker.phases import Method, Options, Refinement, Setup
from services.tracker.prior.file import parse_prior, read_prior
from services.tracker.prior.model import Prior
from services.tracker.ready import load_compiled
from services.tracker.states import State
from services.tracker.step import counts, describe, initial_state, knows_nobody, pending, step

logger = logging.getLogger(__name__)

ID = "main"


def tracker_service(rig: Rig) -> Service[Setup, State, Never]:
    """The tracker of a rig.  Raises ValueError for a method without one, PriorError and OSError for its prior."""
    recorded = recorded_rig(rig)
    anatomy = anatomy_in(recorded)
    prior = None if rig.tracker is None or rig.tracker.prior is None else read_prior(rig.tracker.prior, anatomy)
    setup = setup_of(recorded, prior)
    topics = (
        Subscription(SILHOUETTE, every=True),
        Subscription(CAMERA),
        Subscription(HEALTH, names={"service": "viewer"}),
        Subscription(REQUEST),
    )
    return Service(
        "tracker",
        ID,
        setup,
        initial_state(setup),
        step,
        topics,
        describe,
        counts,
        pending=pending,
        recalls=lambda state: (TRACKER_BDP, TRACKER_POSE) if knows_nobody(state) else (),
        result=TrackerPose,
    )


def setup_of(rig: RecordedRig, prior: Prior | None) -> Setup:
    """The tracker's setup, of a rig or of what a take says of one.  Raises ValueError."""
    if rig.tracker is None:
        raise ValueError(f"method {rig.method!r} has no tracker")
    options = Options(
        method=_method(rig.method),
        particles=rig.tracker.particles,
        points=rig.tracker.points,
        iterations=rig.tracker.iterations,
        seed=rig.tracker.seed,
        refinement=_refinement(rig.tracker.refinement),
    )
    return Setup(anatomy_in(rig), rig.cameras(), rig.frame_ns(), prior, options, rig.person_height)


def anatomy_in(rig: RecordedRig) -> Anatomy:
    """The body that the tracker has.  Raises ValueError."""
    name = rig.tracker.anatomy if rig.tracker else ""
    if name not in ANATOMIES:
        raise ValueError(f"tracker.anatomy = {name!r}: allowed: {', '.join(ANATOMIES)}")
    return ANATOMIES[name]


def prior_in(rig: RecordedRig, path: Path, attached: bytes | None) -> Prior | None:
    """The prior that a take was made with.  path: of the take.  Raises TakeError when it is not the one it says."""
    digest = rig.tracker.prior_sha256 if rig.tracker else None
    if digest is None:
        return None
    if attached is None:
        raise TakeError(f"{path}: attachment {PRIOR_FILE} is missing: the prior that the take was made with is not known")
    found = hashlib.sha256(attached).hexdigest()
    if found != digest:
        raise ValueError(
            f"{path}: attachment {PRIOR_FILE}: sha256 = {found[:12]}...: allowed: {digest[:12]}..., as made with"
        )
    return parse_prior(path / PRIOR_FILE, attached, anatomy_in(rig))


def run_tracker(rig: Rig, options: ZenohOptions, stopped: Callable[[], bool]) -> int:
    """Run until `stopped`; returns the exit status.  Raises BusError, PriorError, OSError and ValueError before it runs."""
    clock = RealClock()
    service = tracker_service(rig)
    logger.info("getting ready; the first time ever compiles for some 20 s")
    load_compiled(service.setup)
    with ZenohBus.open(options, rig.name, clock, stopped) as bus:
        bus.introduce(about(rig, "tracker", ID, clock.now_ns()))
        return run(service, bus, clock, stopped=stopped)


def _method(text: str) -> Method:
    for method in get_args(Method):
        if text == method:
            known: Method = method
            return known
    raise ValueError(f"method = {text!r}: allowed with a tracker: {', '.join(get_args(Method))}")


def _refinement(text: str) -> Refinement:
    for refinement in get_args(Refinement):
        if text == refinement:
            known: Refinement = refinement
            return known
    raise ValueError(f"tracker.refinement = {text!r}: allowed: {', '.join(get_args(Refinement))}")
