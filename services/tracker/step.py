"""The tracker's step: silhouettes of any views in; the body once, and the pose of every instant, out.  [Hybrid II]

Silhouettes are paired as they come; the work on an instant is put off to a Tick, which comes when nothing else waits.
So a tracker that cannot keep up drops its oldest instants, and what it says depends on its events alone.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from common.body.anatomy import Anatomy, Floats
from common.body.definition import Pose
from common.bus.protocol import Alive, Envelope, FrameLike, Tick
from common.camera.pinhole import Camera
from common.conversion import angles_by_name, angles_of, bdp_of, body_of, packed_points
from common.messages import CameraInfo, Health, Message, Request, ScenePoints, Silhouette, TrackerBdp, TrackerPose
from common.pairing import Instant, Pairs, offer
from common.runtime.clock import clock_warning, offset_in, to_integrator_ns
from common.vision.packing import unpack
from services.tracker import tracking
from services.tracker.states import LEAST_VIEWS, MOST_READY, State
from services.tracker.tracking import Mask, Outcome, Setup

__all__ = ["counts", "describe", "initial_state", "pending", "step"]

Event = FrameLike | Envelope | Alive | Tick  # the loop's; the tracker has no frames
Result: TypeAlias = tuple[State, list[Message]]

MOST_SPREAD = 100.0  # what the message allows
POINTS_NS = 100_000_000  # between two instants whose points are said: for people to look at
SAME_CAMERA = 1e-6  # relative


def initial_state(setup: Setup) -> State:
    return State(tracking.initial_state(setup), Pairs(tuple(setup.cameras), setup.frame_ns // 2))


def step(setup: Setup, state: State, event: Event) -> Result:
    """One event.  Pure: the state and the messages depend on the arguments alone."""
    match event:
        case Tick() if state.ready:
            return _track(setup, replace(state, ready=state.ready[1:]), state.ready[0])
        case Envelope(message=Silhouette() as silhouette):
            return _pair(state, silhouette), []
        case Envelope(message=Health(service="viewer", id=viewer) as health) if viewer in setup.cameras:
            return _set_clock(setup, state, viewer, health), []
        case Envelope(message=CameraInfo(viewer=viewer) as camera) if viewer in setup.cameras:
            return _compare(state, camera, setup.cameras[viewer]), []
        case Envelope(message=TrackerBdp() | TrackerPose() as said) if knows_nobody(state):
            return _resume(setup, state, said)
        case Envelope(message=Request(what="measure")):
            return replace(state, track=tracking.initial_state(setup), pose=None, findings=(), said=None, anew=True), []
        case _:
            return state, []


def knows_nobody(state: State) -> bool:
    """Whether this tracker would hear what the one before it had said, and has not been told to forget it."""
    return tracking.knows_nobody(state.track) and not state.anew


def pending(state: State) -> bool:
    """Whether an instant waits for a Tick."""
    return bool(state.ready)


def describe(state: State) -> str:
    """What the tracker is doing, for its health."""
    missing = [viewer for viewer in state.pairs.viewers if state.pairs.missed.get(viewer, 0) > 2]
    if state.pairs.last_ns < 0:
        return "waiting for silhouettes"
    if len(state.pairs.viewers) - len(missing) < LEAST_VIEWS:
        words = f"waiting for a second view; viewer {' and '.join(missing)} not there"
    else:
        words = tracking.describe(state.track) + (f", without viewer {' and '.join(missing)}" if missing else "")
    return "; ".join([words, *state.findings, *state.warnings.values(), *state.calibrations.values()])


def counts(state: State) -> Mapping[str, int]:
    """Silhouettes that were late, doubled, out of order, damaged; instants that lacked a view or were dropped."""
    return {f"silhouette_{what}": count for what, count in state.pairs.counts.items()} | dict(state.counts)


def _resume(setup: Setup, state: State, said: TrackerBdp | TrackerPose) -> Result:
    """What a tracker before this one had said: with body and pose the person can be found.  It is said again."""
    try:
        match said:
            case TrackerBdp() if state.said is None:
                bdp_of(setup.anatomy, said.body)
                return replace(state, said=said), [said]
            case TrackerPose() if state.said is not None:
                body = bdp_of(setup.anatomy, state.said.body)
                angles = angles_of(setup.anatomy, said.angles, setup.anatomy.neutral)
                pose = Pose(np.array(said.position), angles)
                track = tracking.resumed(setup, state.track, body, pose, said.captured_ns)
                return replace(state, track=track, pose=said, said=None), [said]
    except ValueError:  # of another anatomy: this rig has been changed meanwhile
        return state, []
    return state, []


def _pair(state: State, silhouette: Silhouette) -> State:
    captured_ns = to_integrator_ns(silhouette.captured_ns, state.offsets.get(silhouette.viewer))
    pairs, instants = offer(state.pairs, silhouette.viewer, captured_ns, silhouette)
    state = replace(state, pairs=pairs)
    enough = [instant for instant in instants if len(instant.items) >= LEAST_VIEWS]
    state = _count(state, "alone", len(instants) - len(enough))
    ready = (*state.ready, *enough)
    return _count(replace(state, ready=ready[-MOST_READY:]), "dropped_instants", max(0, len(ready) - MOST_READY))


def _track(setup: Setup, state: State, instant: Instant[Silhouette]) -> Result:
    """Follow the person into one instant."""
    masks: dict[str, Mask] = {}
    for viewer, camera in setup.cameras.items():  # in the rig's order, whoever came first
        silhouette = instant.items.get(viewer)
        if silhouette is None:
            continue
        try:
            masks[viewer] = _mask(silhouette, camera)
        except ValueError:
            state = _count(state, "damaged", 1)
    if len(masks) < LEAST_VIEWS:
        return _count(state, "alone", 1), []
    frame = max(silhouette.frame for silhouette in instant.items.values())
    try:
        track, outcome = tracking.follow(setup, state.track, instant.captured_ns, masks)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError) as problem:  # one instant must not end the rest
        return replace(_count(state, "failed", 1), findings=(f"an instant failed: {problem}",)), []
    state = replace(state, track=track, findings=outcome.findings, used=outcome.views)
    messages: list[Message] = []
    if outcome.body is not None:
        body = body_of(setup.anatomy, outcome.body)
        messages.append(TrackerBdp(frame=frame, captured_ns=instant.captured_ns, body=body))
    pose = _pose_message(setup.anatomy, state.pose, outcome, frame, instant.captured_ns)
    if pose is not None:
        messages.append(pose)
    if abs(instant.captured_ns - state.points_ns) >= POINTS_NS:
        state = replace(state, points_ns=instant.captured_ns)
        points = packed_points(outcome.points)
        messages.append(ScenePoints(frame=frame, captured_ns=instant.captured_ns, points=points))
    return replace(state, pose=pose or state.pose), messages


def _mask(silhouette: Silhouette, camera: Camera) -> Mask:
    """(height, width).  Raises ValueError when it is damaged, or not of the camera's size."""
    if silhouette.size != camera.size:
        raise ValueError(f"viewer {silhouette.viewer}: silhouettes of {silhouette.size}, its camera has {camera.size}")
    return unpack(silhouette.size, silhouette.region, silhouette.data)


def _pose_message(
    anatomy: Anatomy, last: TrackerPose | None, outcome: Outcome, frame: int, captured_ns: int
) -> TrackerPose | None:
    """The pose of an instant; while the person is lost, the last one known, marked so; None before there was any."""
    if outcome.pose is None:
        if last is None:
            return None
        return TrackerPose(
            frame=frame, captured_ns=captured_ns, position=last.position, angles=last.angles,
            position_spread=last.position_spread, spread=last.spread, likelihood=float(outcome.likelihood),
            effective=0.0, lost=True, views=list(outcome.views),
        )  # fmt: skip
    x, y, z = outcome.pose.position.tolist()
    spread = np.minimum(outcome.spread, MOST_SPREAD)
    return TrackerPose(
        frame=frame, captured_ns=captured_ns, position=(x, y, z),
        angles=angles_by_name(anatomy, outcome.pose.angles),
        position_spread=_triple(spread[-3:]), spread=angles_by_name(anatomy, spread[:-3]),
        likelihood=float(outcome.likelihood), effective=float(outcome.effective), lost=outcome.lost,
        views=list(outcome.views),
    )  # fmt: skip


def _triple(values: Floats) -> tuple[float, float, float]:
    return float(values[0]), float(values[1]), float(values[2])


def _set_clock(setup: Setup, state: State, viewer: str, health: Health) -> State:
    """Remember a viewer's clock, and what to tell the person about it."""
    offset = offset_in(health)
    if offset is None:
        return state
    warning = clock_warning(viewer, offset, setup.frame_ns)
    warnings = {other: text for other, text in state.warnings.items() if other != viewer}
    return replace(
        state,
        offsets={**state.offsets, viewer: offset},
        warnings={**warnings, viewer: warning} if warning else warnings,
    )


def _compare(state: State, heard: CameraInfo, known: Camera) -> State:
    """Whether a viewer has the calibration that the tracker's rig says; another machine may have an older file."""
    ours = (known.matrix, known.rotation, known.translation)
    theirs = (heard.matrix, heard.rotation, heard.translation)
    same = tuple(heard.size) == known.size and all(
        np.allclose(np.ravel(our), their, rtol=SAME_CAMERA, atol=SAME_CAMERA)
        for our, their in zip(ours, theirs, strict=True)
    )
    others = {viewer: text for viewer, text in state.calibrations.items() if viewer != heard.viewer}
    text = f"viewer {heard.viewer} has another calibration than this rig file: give both machines the same"
    return replace(state, calibrations=others if same else {**others, heard.viewer: text})


def _count(state: State, what: str, more: int) -> State:
    return replace(state, counts={**state.counts, what: state.counts.get(what, 0) + more}) if more else state
