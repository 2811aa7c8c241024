"""The user's decisions: the direction of the heading at the start, front and back later in a take.

Two views show a person from the front and from behind with almost the same silhouettes.  Where the feet do not show it, a
person who has seen the videos does.
"""

# Paper (added): [Hybrid V] does not ask the user.

from dataclasses import replace

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.services.tracker.body.body_model import RootedPose
from zenocap.services.tracker.evidence.evidence import Evidence
from zenocap.services.tracker.filter.filter_step import residual_weights, start_tracking
from zenocap.services.tracker.initialization.relocalization import error_of
from zenocap.services.tracker.initialization.twins import exchanged
from zenocap.services.tracker.parameters import DECIDED_FRONT_DEG, DECIDED_HEADING_DEG, PARTICLE_HOLD, SEARCH_PASSES
from zenocap.services.tracker.states import HEADING_KINDS, Outcome, TrackerSetup, Tracking, refuted


def decided_front(setup: TrackerSetup, place: Floats) -> Floats | None:
    """(3,) horizontal unit vector along which a person at `place` (3,) faces at the start; None without a decision."""
    options = setup.options
    if options.heading is not None:
        return np.array([np.sin(options.heading), 0.0, np.cos(options.heading)])
    if options.front is None:
        return None
    towards = (setup.cameras[options.front].centre - place) * [1.0, 0.0, 1.0]
    unit: Floats = towards / max(float(np.linalg.norm(towards)), 1e-9)
    return unit


def faces(pose: RootedPose, front: Floats) -> bool:
    """Whether a pose faces along `front` (3,), rather than away from it."""
    return float(pose.rotation[:, 2] @ front) >= 0.0


def allowed(setup: TrackerSetup, pose: RootedPose) -> bool:
    """Whether the heading of a pose is about that which the user has decided for the start; True without a decision."""
    front, options = decided_front(setup, pose.position), setup.options
    most = DECIDED_FRONT_DEG if options.heading is None else DECIDED_HEADING_DEG
    return front is None or float(heading_of(pose) @ front) >= np.cos(np.radians(most))


def heading_of(pose: RootedPose) -> Floats:
    """(3,) horizontal unit vector of a pose's heading: of one who lies, before leaning to the front or back."""
    _, up, front = pose.rotation.T
    along = (front - front[1] * up) * [1.0, 0.0, 1.0]
    unit: Floats = along / max(float(np.linalg.norm(along)), 1e-9)
    return unit


def started(setup: TrackerSetup, phase: Tracking, captured_ns: int) -> Tracking:
    """A track that has begun at this time, with the user's decision on its heading."""
    decides = decided_front(setup, phase.estimate.position) is not None
    return by_decision(phase, captured_ns) if decides else phase


def by_decision(phase: Tracking, captured_ns: int) -> Tracking:
    """The track with a heading that the user has decided at this time."""
    rivals = (*(one for one in phase.rivals if one.kind not in HEADING_KINDS), *refuted(*HEADING_KINDS))
    return replace(phase, person=replace(phase.person, heading_known=True), decided_ns=captured_ns, rivals=rivals)


def turned_as_decided(
    setup: TrackerSetup, phase: Tracking, outcome: Outcome, captured_ns: int, evidence: Evidence
) -> tuple[Tracking, Outcome]:
    """The track turned round where a take is tracked again with the opposite heading from this frame set on."""
    for turn in setup.options.turns:
        if turn.captured_ns == captured_ns and not faces(phase.estimate, np.array(turn.front)):
            phase, outcome = _turned(setup, phase, outcome, captured_ns, evidence)
    return phase, outcome


def _turned(
    setup: TrackerSetup, phase: Tracking, outcome: Outcome, captured_ns: int, evidence: Evidence
) -> tuple[Tracking, Outcome]:
    person = phase.person
    pose = exchanged(setup, person, evidence, phase.estimate, "back", SEARCH_PASSES)
    error = error_of(person.model, evidence, residual_weights(setup, PARTICLE_HOLD), pose)
    after, turned = start_tracking(setup, replace(person, heading_known=True), pose, captured_ns, error)
    return replace(after, rivals=()), replace(turned, body=outcome.body)
