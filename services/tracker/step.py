"""Step of the tracker: silhouettes in; the body once, and poses, out.  [Hybrid II]

Silhouettes are synchronized on arrival.  A frame set is tracked on the next Tick, which arrives when the input queue is
empty.  An overloaded tracker drops its oldest frame sets, and the output depends only on the sequence of events.  Two may
wait, so that jitter drops none.  Under overload both places would always be taken, and every pose late by another period:
then only the newest waits.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from zenocap.common import messages as m
from zenocap.common.arrays import Mask
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Pose
from zenocap.common.bus.protocol import Alive, Envelope, FrameLike, Tick
from zenocap.common.camera.pinhole import Camera
from zenocap.common.conversion import angles_by_name, angles_of, bdp_of, body_of, packed_points, silhouette_mask
from zenocap.common.runtime.clock_offset import clock_warning, offset_in, to_integrator_ns
from zenocap.common.runtime.frame_rate import FULL, holds_from_ns, is_too_slow, share_of
from zenocap.common.synchronizer import FrameSet, Synchronizer, push, with_spacing
from zenocap.services.tracker import parameters as p
from zenocap.services.tracker import tracking
from zenocap.services.tracker.filter.confidence import confidences
from zenocap.services.tracker.states import Outcome, TrackerSetup, TrackerState, with_detail

Event = FrameLike | Envelope | Alive | Tick  # the loop's; the tracker has no frames
Result: TypeAlias = tuple[TrackerState, list[m.Message]]


def initial_state(setup: TrackerSetup) -> TrackerState:
    """State before any event."""
    pairs: Synchronizer[m.Silhouette] = Synchronizer(tuple(setup.cameras), setup.frame_ns // 2, hold=setup.hold({}))
    return TrackerState(tracking.initial_state(setup), pairs)


def step(setup: TrackerSetup, state: TrackerState, event: Event) -> Result:
    """Process one event: (state, messages).  Pure: the result depends only on the arguments."""
    match event:
        case Tick() if state.ready:
            later = replace(state, ready=state.ready[1:], behind=max(0, state.behind - 1))
            return _track(setup, later, state.ready[0])
        case Envelope(message=m.Silhouette() as silhouette):
            return _synchronize(state, silhouette), []
        case Envelope(message=m.Health(service="viewer", id=viewer) as health) if viewer in setup.cameras:
            return _set_clock(setup, state, viewer, health), []
        case Envelope(message=m.FrameRate() as rate) if not is_too_slow(rate, 1e9 / setup.frame_ns):
            pairs = with_spacing(state.pairs, share_of(rate).spacing, holds_from_ns(rate))
            return replace(state, pairs=pairs, reduced=share_of(rate) != FULL), []
        case Envelope(message=m.TrackerDetail(share=share)):
            return replace(state, detail=share), []
        case Envelope(message=m.CameraDelays(applied_ms=applied)) if setup.follow_delays:
            return _set_delays(setup, state, {viewer: round(1e6 * ms) for viewer, ms in applied.items()}), []
        case Envelope(message=m.CameraInfo(viewer=viewer) as camera) if viewer in setup.cameras:
            return _compare_calibration(state, camera, setup.cameras[viewer]), []
        case Envelope(message=m.TrackerBdp() | m.TrackerPose() as previous) if awaiting_person(state):
            return _resume(setup, state, previous)
        case Envelope(message=m.TrackerBdp(body=body)):
            own = state.body
            return (state if own is None or body == own.body else replace(state, contradicted=True)), []
        case Envelope(message=m.Request(what="measure")):
            fresh = tracking.remeasure(setup)
            return replace(state, track=fresh, pose=None, findings=(), previous_body=None, remeasure=True, body=None), []
        case _:
            return state, []


def awaiting_person(state: TrackerState) -> bool:
    """True when body and pose published before a restart would be recovered: no body yet, no measurement requested."""
    return tracking.awaiting_person(state.track) and not state.remeasure


def pending(state: TrackerState) -> bool:
    """True when a frame set waits for a Tick."""
    return bool(state.ready)


def phase_of(state: TrackerState) -> m.Phase:
    """Phase of the tracker, for its health."""
    if state.pairs.last_ns < 0 or len(state.pairs.viewers) - len(_missing(state)) < p.MIN_VIEWS:
        return m.Phase.WAITING_FOR_INPUT
    return tracking.phase_of(state.track)


def describe(state: TrackerState) -> str:
    """Health text of the tracker."""
    missing = _missing(state)
    if state.pairs.last_ns < 0:
        return "waiting for silhouettes"
    if len(state.pairs.viewers) - len(missing) < p.MIN_VIEWS:
        text = f"waiting for a second view; viewer {' and '.join(missing)} missing"
    else:
        text = tracking.describe(state.track) + (f", without viewer {' and '.join(missing)}" if missing else "")
    return "; ".join([text, *state.findings, *state.warnings.values(), *state.calibrations.values()])


def _missing(state: TrackerState) -> list[str]:
    return [viewer for viewer in state.pairs.viewers if state.pairs.missed.get(viewer, 0) > p.MISSING_FRAMES]


def counts(state: TrackerState) -> Mapping[str, int]:
    """Counts of silhouettes that were late, duplicate, out of order or damaged, and of frame sets incomplete or dropped.

    Whole and incomplete: frame sets with and without all views that are waited for.
    """
    silhouettes = {f"silhouette_{reason}": count for reason, count in state.pairs.counts.items()}
    instants = {"whole_instants": state.pairs.complete, "incomplete_instants": state.pairs.incomplete}
    return silhouettes | instants | dict(state.counts)


def _resume(setup: TrackerSetup, state: TrackerState, previous: m.TrackerBdp | m.TrackerPose) -> Result:
    """Recover the body, then the pose, published before a restart, and publish them again."""
    try:
        match previous:
            case m.TrackerBdp() if state.previous_body is None:
                bdp_of(setup.anatomy, previous.body)
                return replace(state, previous_body=previous, body=previous), [previous]
            case m.TrackerPose() if state.previous_body is not None:
                body = bdp_of(setup.anatomy, state.previous_body.body)
                angles = angles_of(setup.anatomy, previous.angles, setup.anatomy.neutral)
                pose = Pose(np.array(previous.position), angles)
                measured = state.previous_body.measured
                track = tracking.resume(setup, state.track, body, pose, previous.captured_ns, measured=measured)
                return replace(state, track=track, pose=previous, previous_body=None), [previous]
    except ValueError:  # of another anatomy: the rig has been changed
        return state, []
    return state, []


def _set_delays(setup: TrackerSetup, state: TrackerState, delays_ns: dict[str, int]) -> TrackerState:
    """Correct the capture times by these delays from now on."""
    pairs = replace(state.pairs, hold=setup.hold(delays_ns))
    track = state.track if delays_ns == state.delays_ns else tracking.with_other_times(state.track)
    return replace(state, delays_ns=delays_ns, pairs=pairs, track=track)


def _synchronize(state: TrackerState, silhouette: m.Silhouette) -> TrackerState:
    captured_ns = to_integrator_ns(silhouette.captured_ns, state.offsets.get(silhouette.viewer))
    captured_ns = max(0, captured_ns - state.delays_ns.get(silhouette.viewer, 0))
    pairs, frame_sets = push(state.pairs, silhouette.viewer, captured_ns, silhouette)
    state = replace(state, pairs=pairs)
    enough = [frame_set for frame_set in frame_sets if len(frame_set.items) >= p.MIN_VIEWS]
    state = _count(state, "alone", len(frame_sets) - len(enough))
    places = 1 if state.behind or state.reduced or state.detail < 1 else p.MAX_QUEUED_FRAME_SETS
    ready, dropped = (*state.ready, *enough), max(0, len(state.ready) + len(enough) - places)
    behind = p.BEHIND_FRAME_SETS if dropped else state.behind
    return replace(_count(state, "dropped_instants", dropped), ready=ready[-places:], behind=behind)


def _track(setup: TrackerSetup, state: TrackerState, frame_set: FrameSet[m.Silhouette]) -> Result:
    """Track the person in one frame set."""
    masks: dict[str, Mask] = {}
    for viewer, camera in setup.cameras.items():  # in the rig's order, not that of arrival
        silhouette = frame_set.items.get(viewer)
        if silhouette is None:
            continue
        try:
            masks[viewer] = silhouette_mask(silhouette, camera.size)
        except ValueError:
            state = _count(state, "damaged", 1)
    if len(masks) < p.MIN_VIEWS:
        return _count(state, "alone", 1), []
    frame, captured_ns = max(silhouette.frame for silhouette in frame_set.items.values()), frame_set.captured_ns
    try:
        track, outcome = tracking.track(with_detail(setup, state.detail), state.track, captured_ns, masks)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError) as problem:  # one frame set must not end the service
        return replace(_count(state, "failed", 1), findings=(f"a frame set failed: {problem}",)), []
    own, messages = state.body, list[m.Message]()
    if outcome.body is not None:
        body = body_of(setup.anatomy, outcome.body)
        own = m.TrackerBdp(frame=frame, captured_ns=captured_ns, body=body, measured=outcome.measured)
    if own is not None and (outcome.body is not None or state.contradicted):
        messages.append(own)
    state = replace(state, track=track, findings=outcome.findings, used=outcome.views, body=own, contradicted=False)
    pose = _pose_message(setup.anatomy, state.pose, outcome, frame, captured_ns)
    if pose is not None:
        messages.append(pose)
    if abs(captured_ns - state.points_ns) >= p.POINTS_PERIOD_NS:
        state = replace(state, points_ns=captured_ns)
        messages.append(m.ScenePoints(frame=frame, captured_ns=captured_ns, points=packed_points(outcome.points)))
    return replace(state, pose=pose or state.pose), messages


def _pose_message(
    anatomy: Anatomy, last: m.TrackerPose | None, outcome: Outcome, frame: int, captured_ns: int
) -> m.TrackerPose | None:
    """Pose message of a frame set; the last pose, marked as lost, without one; None before the first."""
    if outcome.pose is None:
        if last is None:
            return None
        return m.TrackerPose(
            frame=frame, captured_ns=captured_ns, position=last.position, angles=last.angles,
            position_spread=last.position_spread, spread=last.spread, likelihood=float(outcome.likelihood),
            effective=0.0, lost=True, views=list(outcome.views),
        )  # fmt: skip
    x, y, z = outcome.pose.position.tolist()
    spread = np.minimum(outcome.spread, p.MAX_SPREAD)
    dx, dy, dz = spread[-3:].tolist()
    limbs, heading = confidences(outcome.limb_features, outcome.toes, outcome.against)
    return m.TrackerPose(
        frame=frame, captured_ns=captured_ns, position=(x, y, z),
        angles=angles_by_name(anatomy, outcome.pose.angles),
        position_spread=(dx, dy, dz), spread=angles_by_name(anatomy, spread[:-3]),
        likelihood=float(outcome.likelihood), effective=float(outcome.effective), lost=outcome.lost,
        views=list(outcome.views), limbs=limbs, lost_limbs=[limb for limb, score in limbs.items() if score < p.LOST_LIMB],
        heading=heading,
    )  # fmt: skip


def _set_clock(setup: TrackerSetup, state: TrackerState, viewer: str, health: m.Health) -> TrackerState:
    """Update a viewer's clock offset and the health text about it."""
    offset = offset_in(health)
    if offset is None:
        return state
    warning = clock_warning(f"viewer {viewer}", offset, setup.frame_ns)
    warnings = {other: text for other, text in state.warnings.items() if other != viewer}
    warnings |= {viewer: warning} if warning else {}
    return replace(state, offsets={**state.offsets, viewer: offset}, warnings=warnings)


def _compare_calibration(state: TrackerState, received: m.CameraInfo, configured: Camera) -> TrackerState:
    """Update the health text about a viewer whose calibration differs from this rig file's."""
    configured_values = (configured.matrix, configured.rotation, configured.translation)
    received_values = (received.matrix, received.rotation, received.translation)
    same = tuple(received.size) == configured.size and all(
        np.allclose(np.ravel(configured_value), received_value, rtol=p.CAMERA_TOLERANCE, atol=p.CAMERA_TOLERANCE)
        for configured_value, received_value in zip(configured_values, received_values, strict=True)
    )
    others = {viewer: text for viewer, text in state.calibrations.items() if viewer != received.viewer}
    text = f"viewer {received.viewer} has another calibration than this rig file: copy the same file to both machines"
    return replace(state, calibrations=others if same else {**others, received.viewer: text})


def _count(state: TrackerState, reason: str, number: int) -> TrackerState:
    return replace(state, counts={**state.counts, reason: state.counts.get(reason, 0) + number}) if number else state
