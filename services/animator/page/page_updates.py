"""Updates of a page: parts of the state that have changed and are due, encoded.  Pure.

Poses are sent on arrival; silhouettes, services and set-up checks at the rates of `zenocap.services.animator.parameters`.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeVar

import numpy as np

from zenocap.common import messages as m
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp, neutral_pose
from zenocap.common.camera.pinhole import Camera
from zenocap.common.camera_advice import change_text, found_text
from zenocap.common.conversion import silhouette_mask
from zenocap.common.observe.losses import described
from zenocap.common.observe.view import ObservedService, rows
from zenocap.common.runtime.frame_rate import reduced_text
from zenocap.common.web.broadcast import EncodedUpdate, encoded
from zenocap.services.animator import parameters
from zenocap.services.animator.body_geometry import capsule_shapes, part_outlines, placed_capsules
from zenocap.services.animator.page import page_messages as pm
from zenocap.services.animator.presence import Presence, condition, silent_ns
from zenocap.services.animator.setup_guide import Finding, measure_silhouette, silhouette_findings
from zenocap.services.animator.states import ActorPose, AnimatorState, Source

POSITION_DIGITS, SHAPE_DIGITS, QUATERNION_DIGITS, DEGREE_DIGITS, PIXEL_DIGITS = 3, 4, 4, 1, 1  # after the point
NEVER_NS = -(1 << 62)
K = TypeVar("K")
V = TypeVar("V")


@dataclass(frozen=True)
class Schedule:
    """Last updates and their times, by a monotonic clock.  silhouettes, actors: those of the last view updates."""

    state: AnimatorState = field(default_factory=AnimatorState)
    silhouettes: Mapping[str, m.Silhouette] = field(default_factory=dict)
    actors: Mapping[Source, ActorPose] = field(default_factory=dict)
    views_ns: int = NEVER_NS
    services_ns: int = NEVER_NS
    checks_ns: int = NEVER_NS


def due_updates(
    schedule: Schedule, state: AnimatorState, presence: Presence, pages: int, now_ns: int
) -> tuple[Schedule, list[EncodedUpdate]]:
    """Return the updates that are due, and the schedule after them.  pages: number of open pages.  now_ns: monotonic."""
    if state is schedule.state:
        return schedule, []
    updates = list(changes(schedule.state, state))
    silhouettes, actors = schedule.silhouettes, schedule.actors
    views_ns, services_ns, checks_ns = schedule.views_ns, schedule.services_ns, schedule.checks_ns
    if now_ns - views_ns >= parameters.VIEWS_PERIOD_NS and _views_changed(schedule, state):
        views_ns, silhouettes, actors = now_ns, state.silhouettes, state.actors
        updates += view_updates(state)
    if now_ns - services_ns >= parameters.SERVICES_PERIOD_NS:
        services_ns = now_ns
        updates.append(services_update(state, presence, pages, now_ns))
    if now_ns - checks_ns >= parameters.CHECKS_PERIOD_NS:
        checks_ns = now_ns
        updates.append(checks_update(state, presence))
    return Schedule(state, silhouettes, actors, views_ns, services_ns, checks_ns), updates


def _views_changed(schedule: Schedule, state: AnimatorState) -> bool:
    """True for a new pose to draw into the silhouettes, or for a new silhouette while no poses arrive."""
    posed = any(state.now_ns - actor.received_ns < parameters.POSE_WAIT_NS for actor in state.actors.values())
    return state.actors is not schedule.actors if posed else state.silhouettes is not schedule.silhouettes


def changes(before: AnimatorState, after: AnimatorState) -> Iterator[EncodedUpdate]:
    """Yield updates of bodies, poses, points, cameras, postures, commands, previews and advice that differ between states.

    Commands are also sent after the initial state, so that a page knows which of them are old.
    """
    for source, body in _new(before.bodies, after.bodies):
        yield encoded(f"body/{source}", body_update(source, body.anatomy, body.bdp))
    for source, actor in _new(before.actors, after.actors):
        yield encoded(f"pose/{source}", pose_update(actor))
    if after.points is not None and before.points is not after.points:
        yield encoded("points", pm.PointsUpdate(after.points.points, after.points.captured_ns / 1e6))
    for viewer, camera in _new(before.cameras, after.cameras):
        yield encoded(f"camera/{viewer}", _camera_update(viewer, camera))
    if after.posture is not None and before.posture is not after.posture:
        posture = after.posture
        yield encoded("posture", pm.PostureUpdate(posture.label or "", round(posture.margin, 2), _best_models(posture)))
    if not before.now_ns or before.commands is not after.commands:
        yield encoded("commands", pm.CommandsUpdate(list(map(_command_row, after.commands)), live=before.now_ns > 0))
    for viewer, preview in _new(before.previews, after.previews):
        yield encoded(f"preview/{viewer}", pm.PreviewUpdate(viewer, preview.jpeg))
    for viewer, advice in _new(before.advice, after.advice):
        known = before.advice.get(viewer)
        if known is None or known.faults != advice.faults:
            lines = [pm.AdviceLine(fault.code.value, found_text(fault), change_text(fault)) for fault in advice.faults]
            yield encoded(f"advice/{viewer}", pm.AdviceUpdate(viewer, lines))


def _new(before: Mapping[K, V], after: Mapping[K, V]) -> Iterator[tuple[K, V]]:
    """The entries that are other objects than before."""
    return ((key, value) for key, value in after.items() if before.get(key) is not value)


def view_updates(state: AnimatorState) -> Iterator[EncodedUpdate]:
    """Yield each viewer's latest silhouette with the model's outlines."""
    for viewer, silhouette in state.silhouettes.items():
        yield encoded(f"view/{viewer}", _view_update(state, viewer, silhouette))


def services_update(state: AnimatorState, presence: Presence, pages: int, now_ns: int) -> EncodedUpdate:
    """Return the status of all services and of the log."""
    recording, written = _recording(presence)
    reduced = reduced_text(state.frame_rate, state.detail)
    found = {(row.service, row.id): row for row in rows(presence.view, now_ns)}
    shown = [_service_row(presence, found[service], now_ns) for service in presence.services]
    return encoded("services", pm.ServicesUpdate(shown, recording, written, pages, reduced))


def _recording(presence: Presence) -> tuple[bool | None, int]:
    """Whether a take is being written, None without a log, and the number of messages in it."""
    logs = [health.counts for (service, _), health in presence.view.health.items() if service == "integrator"]
    recording = None if not logs else any(counts.get("log_on") and not counts.get("log_stopped") for counts in logs)
    return recording, max((counts.get("log_messages", 0) for counts in logs), default=0)


def recording_update(presence: Presence) -> EncodedUpdate:
    """Return the state of the log of the rig."""
    return encoded("recording", pm.RecordingUpdate(*_recording(presence)))


def checks_update(state: AnimatorState, presence: Presence) -> EncodedUpdate:
    """Return the set-up checks before the body is measured, by viewer, and the next step for the rig."""
    health = presence.view.health
    viewers = dict.fromkeys((*(id for service, id in presence.services if service == "viewer"), *state.silhouettes))
    found = {
        id: [pm.Check(*one) for one in (_background_finding(health.get(("viewer", id))), *_silhouette_findings(state, id))]
        for id in viewers
    }
    solvers = [health[key] for key in presence.services if key[0] in ("integrator", "tracker") and key in health]
    waiting = [one for one in solvers if one.phase is not m.Phase.RUNNING]
    if not waiting:
        return encoded("checks", pm.ChecksUpdate(found, "waiting for the integrator", calm=False))
    last = waiting[-1]
    calm = last.phase is m.Phase.TRACKING and last.state == last.phase  # a text that says more asks for something
    return encoded("checks", pm.ChecksUpdate(found, last.state, calm))


def _flat(array: Floats, decimals: int) -> list[float]:
    values: list[float] = np.round(array, decimals).ravel().tolist()
    return values


def body_update(source: str, anatomy: Anatomy, bdp: Bdp) -> pm.BodyUpdate:
    """Return the shape of a body."""
    shapes = capsule_shapes(bdp)
    upright = placed_capsules(anatomy, bdp, neutral_pose(anatomy, np.zeros(3)))
    return pm.BodyUpdate(
        source, list(anatomy.parts),
        _flat(shapes.lengths, SHAPE_DIGITS), _flat(shapes.near, SHAPE_DIGITS), _flat(shapes.far, SHAPE_DIGITS),
        [marker.name for marker in anatomy.markers], list(anatomy.angles),
        round(float(np.ptp(upright.centres[:, 1])), POSITION_DIGITS),
    )  # fmt: skip


def pose_update(actor: ActorPose) -> pm.PoseUpdate:
    """Return the pose of an actor, with the places of its capsules and joint centres."""
    placed = placed_capsules(actor.anatomy, actor.body, actor.pose)
    return pm.PoseUpdate(
        actor.source, actor.frame, actor.captured_ns / 1e6, actor.received_ns / 1e6,
        _flat(placed.positions, POSITION_DIGITS), _flat(placed.quaternions, QUATERNION_DIGITS),
        _flat(placed.centres, POSITION_DIGITS),
        _flat(np.degrees(actor.pose.angles), DEGREE_DIGITS), list(actor.lost),
    )  # fmt: skip


def _camera_update(viewer: str, camera: Camera) -> pm.CameraUpdate:
    width, height = camera.size
    corners = np.array([[-0.5, -0.5], [width - 0.5, -0.5], [width - 0.5, height - 0.5], [-0.5, height - 0.5]])
    local = np.column_stack([corners, np.ones(4)]) @ np.linalg.inv(camera.matrix).T
    world = local @ camera.rotation + camera.centre
    return pm.CameraUpdate(viewer, camera.name, camera.size, _flat(camera.centre, SHAPE_DIGITS), _flat(world, SHAPE_DIGITS))


def _view_update(state: AnimatorState, viewer: str, silhouette: m.Silhouette) -> pm.ViewUpdate:
    camera = state.cameras.get(viewer)
    outlines: dict[str, list[pm.PartOutline]] = {}
    if camera is not None and camera.size == silhouette.size:
        for source, actor in state.actors.items():
            if "person" not in actor.lost:
                parts = part_outlines(actor.anatomy, actor.body, actor.pose, camera)
                outlines[source] = [pm.PartOutline(part, _flat(corners, PIXEL_DIGITS)) for part, corners in parts]
    sighting = state.sightings.get(viewer)
    assigned = state.assignment.views.get(viewer) if state.assignment else None
    return pm.ViewUpdate(
        viewer, silhouette.size, silhouette.region, silhouette.data, outlines, assigned.view if assigned else "",
        round(sighting.score, 3) if sighting and sighting.score else None,
        round(assigned.scale, 3) if assigned else None,
    )  # fmt: skip


def _best_models(posture: m.Posture) -> list[tuple[str, float]]:
    """Return the best models and their log-likelihoods, best first."""
    best = sorted(posture.log_likelihoods.items(), key=lambda pair: -pair[1])[: parameters.BEST_POSTURES]
    return [(label, round(value, 1)) for label, value in best]


def _command_row(result: m.CommandResult) -> pm.CommandRow:
    latency_ms, since_end_ms, since_start_ms = (
        round(value / 1e6, 2) for value in (result.latency_ns, result.since_end_ns, result.since_start_ns)
    )
    return pm.CommandRow(
        result.frame, result.captured_ns / 1e6, result.posture, result.action, result.target, round(result.confidence, 3),
        latency_ms, since_end_ms, since_start_ms, result.outcome,
    )  # fmt: skip


def _service_row(presence: Presence, row: ObservedService, now_ns: int) -> pm.ServiceRow:
    service = row.service, row.id
    health = presence.view.health.get(service)
    return pm.ServiceRow(
        *service, condition(presence, service, now_ns), round(silent_ns(presence, service, now_ns) / 1e9, 1),
        row.phase, row.words, round(row.rate, 1), None if row.latency_ms is None else round(row.latency_ms, 1),
        [] if health is None else described(health.counts),
        None if row.offset_ms is None else round(row.offset_ms, 3), round(row.memory_mb, 1),
    )  # fmt: skip


def _background_finding(health: m.Health | None) -> Finding:
    if health is None:
        return "background", "wait", "viewer not connected yet"
    if health.phase is m.Phase.LEARNING_BACKGROUND:
        return "background", "wait", f"{health.state}: keep the scene empty"
    return "background", "good", "learned"


def _silhouette_findings(state: AnimatorState, viewer: str) -> list[Finding]:
    silhouette = state.silhouettes.get(viewer)
    if silhouette is None:
        return [("person", "wait", "no silhouette yet")]
    try:
        mask = silhouette_mask(silhouette)
    except ValueError as problem:
        return [("silhouette", "bad", f"damaged: {problem}")]
    found = silhouette_findings(measure_silhouette(mask), _initial_side(state, viewer))
    sighting = state.sightings.get(viewer)
    if sighting is not None and sighting.present and sighting.score:
        verdict: Literal["good", "bad"] = "good" if sighting.score > parameters.GOOD_SCORE else "bad"
        found.append(("fit", verdict, f"matching score {sighting.score:.2f} of 1"))
    return found


def _initial_side(state: AnimatorState, viewer: str) -> Literal["front", "side"] | None:
    """Return the side of the T-pose that a view shows; None once the body is known, or without an assignment."""
    assignment = state.assignment
    if assignment is None or assignment.tracking or viewer not in assignment.views:
        return None
    return "front" if assignment.views[viewer].view == "facade" else "side"
