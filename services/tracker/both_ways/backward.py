"""Backward tracking from the last tracked pose, with the measured body.

Later frames correct earlier errors: a limb that the forward pass lost is tracked backwards from where it was found.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import msgspec

from zenocap.common.arrays import Mask
from zenocap.common.body.definition import Bdp, Pose
from zenocap.services.tracker.body.body_model import RootedPose
from zenocap.services.tracker.evidence.evidence import Evidence, evidence_of, support_fraction
from zenocap.services.tracker.filter.confidence import Confidence, confidences
from zenocap.services.tracker.filter.filter_step import residual_weights, start_tracking
from zenocap.services.tracker.filter.rivals import with_heading
from zenocap.services.tracker.hull.contour_rays import extract_outlines
from zenocap.services.tracker.initialization.relocalization import error_of
from zenocap.services.tracker.parameters import DECIDED_NS, PARTICLE_HOLD
from zenocap.services.tracker.states import AwaitingPerson, Lost, TrackerSetup, Tracking
from zenocap.services.tracker.tracking import advance_phase, known_person, with_features

FIRST_COUNT = 1 << 40  # of frame sets, for the random seeds: the forward pass never counts so far


@dataclass(frozen=True)
class Backward:
    """State of the backward pass.  start_ns: capture time at which it begins.  count: frame sets so far.

    confidence: of the last pose; None at the beginning, which is a pose of the forward pass.
    """

    phase: Tracking | Lost
    start_ns: int
    count: int = 0
    confidence: Confidence | None = None


class Decided:
    """The user's decisions on front and back in the backward pass; asked from the take's end to its beginning.

    They bind it for DECIDED_NS from the start on, from the first of `Options.turns` to the end, where the user has seen the
    poses, and at the last pose before that turn.
    """

    def __init__(self, turns: Sequence[int], start_ns: int | None) -> None:
        """turns: capture times.  start_ns: of the first pose, None without a decision about the start."""
        self._turns, self._start_ns = sorted(turns), start_ns

    @staticmethod
    def of(setup: TrackerSetup, start_ns: int) -> "Decided":
        """Decisions in a set-up.  start_ns: capture time of the first pose."""
        options = setup.options
        at_start = options.front is not None or options.heading is not None
        return Decided([one.captured_ns for one in options.turns], start_ns if at_start else None)

    def passed(self, captured_ns: int) -> bool:
        """Whether at this time the forward pass decides on front and back; later times must have been asked before."""
        if self._turns and captured_ns >= self._turns[0]:
            return True
        if self._turns:  # the last pose before the first turn
            self._turns = []
            return True
        return self._start_ns is not None and captured_ns - self._start_ns < DECIDED_NS


def evidence_in(setup: TrackerSetup, masks: Mapping[str, Mask]) -> Evidence:
    """Evidence of the views that the forward pass has used.  masks: by viewer, (height, width), not 0 on the person."""
    contours, silhouettes = extract_outlines(
        [masks.get(viewer) for viewer in setup.cameras], list(setup.cameras.values()), setup.options.points
    )
    return evidence_of(contours, silhouettes)[0]


def with_fixed_body(setup: TrackerSetup) -> TrackerSetup:
    """The set-up of the backward pass: the sizes of the body stay those of the end of the forward pass."""
    fixed = msgspec.structs.replace(setup.options.filter, shape_estimation=False)
    return replace(setup, options=replace(setup.options, filter=fixed))


def begin(
    setup: TrackerSetup, body: Bdp, pose: Pose, captured_ns: int, evidence: Evidence, heading: float | None = None
) -> Backward:
    """State at the last pose of the forward pass, captured at `captured_ns`, with its own evidence.

    heading: probability of its heading, None where it is certain.
    """
    person, last = known_person(setup, body), RootedPose.of(setup.anatomy, body, pose)
    person = replace(person, expected_support=support_fraction(person.model, evidence, last))
    error = error_of(person.model, evidence, residual_weights(setup, PARTICLE_HOLD), last)
    phase, _ = start_tracking(setup, person, last, 0, error)
    if heading is not None:
        phase = with_heading(phase, heading)
    return Backward(phase, captured_ns)


def step_back(
    setup: TrackerSetup, state: Backward, captured_ns: int, evidence: Evidence
) -> tuple[Backward, RootedPose | None]:
    """State and pose of the next earlier frame set; no pose while the person is searched for."""
    phase, outcome = advance_phase(setup, state.phase, state.start_ns - captured_ns, evidence, FIRST_COUNT + state.count)
    assert not isinstance(phase, AwaitingPerson), "a measured body is never forgotten"
    pose = None
    if isinstance(phase, Tracking) and outcome.pose is not None:
        phase, outcome = with_features(setup, phase, outcome, evidence)
        pose = phase.estimate
    confidence = confidences(outcome.limb_features, outcome.toes, outcome.against)
    return replace(state, phase=phase, count=state.count + 1, confidence=confidence), pose
