"""The recogniser's step: poses in, postures with their begin and end out, as soon as each is known.  [Two-view 5.2]"""

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from common.body.anatomy import Floats
from common.bus.protocol import Alive, Envelope, FrameLike, Tick
from common.conversion import angles_of
from common.messages import Message, Posture, TrackerPose, UniversalBap
from services.recognizer.features import NAMES, features_of
from services.recognizer.states import Setup, State
from services.recognizer.stream import GAP, LATE, Answer, beginning, heard

__all__ = ["counts", "describe", "initial_state", "step"]

Event = FrameLike | Envelope | Alive | Tick  # the loop's; the recogniser has no frames
Result: TypeAlias = tuple[State, list[Message]]


def initial_state(setup: Setup) -> State:
    return State(beginning(setup.plan))


def step(setup: Setup, state: State, event: Event) -> Result:
    """One event.  Pure: the state and the messages depend on the arguments alone."""
    match event:
        case Envelope(message=UniversalBap(lost=lost) as bap) if setup.source == "integrator":
            return _hear(setup, state, bap, "person" in lost)
        case Envelope(message=TrackerPose(lost=lost) as pose) if setup.source == "tracker":
            return _hear(setup, state, pose, lost)
        case _:
            return state, []


def describe(state: State) -> str:
    """What the recogniser is doing, for its health."""
    if state.stream.last_ns < 0:
        return "waiting for poses"
    if state.lost:
        return "waiting for the person"
    if state.last is None:
        return "listening"
    return f"listening; the last was {state.last.label or 'none of its postures'}"


def counts(state: State) -> Mapping[str, int]:
    """Postures and unknown movements that were said; poses that were late, of another body, or first after a gap."""
    return state.counts


def _hear(setup: Setup, state: State, pose: UniversalBap | TrackerPose, lost: bool) -> Result:
    try:
        features = _features(setup, pose, lost)
    except ValueError:
        return _count(state, "other_body"), []
    stream, answer, became = heard(setup.plan, state.stream, pose.captured_ns, features)
    state = replace(state, stream=stream, lost=lost)
    if became in (LATE, GAP):
        state = _count(state, became)
    if answer is None:
        return state, []
    posture = _message(setup, answer, pose)
    return _count(replace(state, last=posture), "unknown" if answer.label is None else "postures"), [posture]


def _features(setup: Setup, pose: UniversalBap | TrackerPose, lost: bool) -> Floats:
    """(d,), NaN while the person is lost.  Raises ValueError for a pose of another anatomy."""
    if lost:
        return np.full(len(NAMES), np.nan)
    if len(pose.angles) != len(setup.anatomy.angles):
        raise ValueError(f"{len(pose.angles)} joint angles: allowed: {len(setup.anatomy.angles)}")
    angles = angles_of(setup.anatomy, pose.angles, setup.anatomy.neutral)
    return features_of(setup.anatomy, angles, setup.plan.kind)


def _message(setup: Setup, answer: Answer, pose: UniversalBap | TrackerPose) -> Posture:
    judgement = answer.judgement
    labels = setup.plan.model.labels
    return Posture(
        frame=pose.frame,
        captured_ns=pose.captured_ns,
        label=answer.label,
        start_ns=answer.start_ns,
        end_ns=answer.end_ns,
        log_likelihoods={label: float(value) for label, value in zip(labels, judgement.log_likelihoods, strict=True)},
        score=float(judgement.scores[judgement.best]),
        margin=judgement.margin / answer.rows,
    )


def _count(state: State, what: str) -> State:
    return replace(state, counts={**state.counts, what: state.counts.get(what, 0) + 1})
