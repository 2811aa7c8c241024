"""Step of the recognizer: poses in, posture events with start and end out.  [Two-view 5.2]"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Literal, TypeAlias

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.bus.protocol import Alive, Envelope, FrameLike, Tick
from zenocap.common.conversion import angles_of
from zenocap.common.messages import Message, Phase, Posture, TrackerPose, UniversalBap
from zenocap.services.recognizer.motion_rows import WIDTH, rows_of
from zenocap.services.recognizer.stream import GAP, LATE, PoseStream, Recognition, StreamSetup, initial_stream, push

Source = Literal["integrator", "tracker"]
Event = FrameLike | Envelope | Alive | Tick  # of the service loop; the recognizer has no frames


@dataclass(frozen=True, eq=False)
class RecognizerSetup:
    """Setup of the recognizer.

    stream: setup of the model's stream.  source: service whose poses are read.  anatomy: of these poses.
    """

    stream: StreamSetup
    source: Source
    anatomy: Anatomy


@dataclass(frozen=True, eq=False)
class RecognizerState:
    """State of the recognizer.

    lost: the person is lost in the latest pose.  last: the latest event.  counts: see `counts`.
    """

    stream: PoseStream
    lost: bool = False
    last: Posture | None = None
    counts: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))


Result: TypeAlias = tuple[RecognizerState, list[Message]]


def initial_state(setup: RecognizerSetup) -> RecognizerState:
    """State before the first pose."""
    return RecognizerState(initial_stream(setup.stream))


def step(setup: RecognizerSetup, state: RecognizerState, event: Event) -> Result:
    """Return the next state and the messages to publish.  Pure: depends on the arguments alone."""
    match event:
        case Envelope(message=UniversalBap(lost=lost) as bap) if setup.source == "integrator":
            return _pose(setup, state, bap, "person" in lost)
        case Envelope(message=TrackerPose(lost=lost) as pose) if setup.source == "tracker":
            return _pose(setup, state, pose, lost)
        case _:
            return state, []


def phase_of(state: RecognizerState) -> Phase:
    """Phase of the recognizer, for its health."""
    if state.stream.last_ns < 0:
        return Phase.WAITING_FOR_INPUT
    return Phase.AWAITING_PERSON if state.lost else Phase.RUNNING


def describe(state: RecognizerState) -> str:
    """Health text of the recognizer."""
    if state.stream.last_ns < 0:
        return "waiting for poses"
    if state.lost:
        return "waiting for the person"
    if state.last is None:
        return "running"
    return f"running; last event: {state.last.label or 'unknown movement'}"


def counts(state: RecognizerState) -> Mapping[str, int]:
    """Number of postures and unknown movements; of poses that were late, of another body, or first after a gap."""
    return state.counts


def _pose(setup: RecognizerSetup, state: RecognizerState, pose: UniversalBap | TrackerPose, lost: bool) -> Result:
    try:
        features = _features(setup, pose, lost)
    except ValueError:
        return _count(state, "other_body"), []
    stream, found, use = push(setup.stream, state.stream, pose.captured_ns, features)
    state = replace(state, stream=stream, lost=lost)
    if use in (LATE, GAP):
        state = _count(state, use)
    if found is None:
        return state, []
    posture = _message(setup, found, pose)
    return _count(replace(state, last=posture), "unknown" if found.label is None else "postures"), [posture]


def _features(setup: RecognizerSetup, pose: UniversalBap | TrackerPose, lost: bool) -> Floats:
    """Row (WIDTH,), NaN while the person is lost.  Raises ValueError for a pose of another anatomy."""
    if lost:
        return np.full(WIDTH, np.nan)
    if len(pose.angles) != len(setup.anatomy.angles):
        raise ValueError(f"{len(pose.angles)} joint angles: allowed: {len(setup.anatomy.angles)}")
    angles = angles_of(setup.anatomy, pose.angles, setup.anatomy.neutral)
    row: Floats = rows_of(setup.anatomy, np.array([pose.position]), angles[None], setup.stream.model.features)[0]
    return row


def _message(setup: RecognizerSetup, found: Recognition, pose: UniversalBap | TrackerPose) -> Posture:
    scores, labels = found.classification, setup.stream.model.labels
    return Posture(
        frame=pose.frame, captured_ns=pose.captured_ns, label=found.label, start_ns=found.start_ns, end_ns=found.end_ns,
        log_likelihoods={label: float(value) for label, value in zip(labels, scores.log_likelihoods, strict=True)},
        score=float(scores.scores[scores.best]), margin=scores.margin,
    )  # fmt: skip


def _count(state: RecognizerState, name: str) -> RecognizerState:
    return replace(state, counts={**state.counts, name: state.counts.get(name, 0) + 1})
