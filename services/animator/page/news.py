"""What the page is told when the state has changed: pieces by name, each as the page reads it.  Pure."""

from collections.abc import Iterator
from typing import Literal

import numpy as np

from common import messages as m
from common.body.anatomy import Floats
from common.body.definition import neutral_pose
from common.camera.pinhole import Camera
from common.vision.packing import unpack
from services.animator.figure import capsules, figure
from services.animator.outlines import outlines
from services.animator.page import wire
from services.animator.page.hub import Piece
from services.animator.setting_up import Finding, findings, shape_of
from services.animator.snapshot import Actor, Row
from services.animator.states import Body, State
from services.animator.step import snapshot

MILLIMETRES, FINE, TENTHS = 3, 4, 1  # decimals of metres, of quaternions, of degrees and pixels
LOSSES = ("dropped_frames", "dropped_instants", "dropped_queue_full", "rejected_invalid", "step_errors", "log_lost")
LIKELIEST = 3  # models of a posture that are shown
AGES = ("result_age", "frame_age")  # stages of a health, the first that is there
MEASURED = "tracking"  # how the state of a service that knows the body begins


def news(before: State, after: State) -> Iterator[Piece]:
    """Pieces of everything that is new."""
    for source, body in after.bodies.items():
        if before.bodies.get(source) is not body:
            yield _piece(f"body/{source}", _body(source, body))
    for source, actor in after.actors.items():
        if before.actors.get(source) is not actor:
            yield _piece(f"pose/{source}", _pose(actor))
    if after.points is not None and before.points is not after.points:
        yield _piece("points", wire.PointsShape(after.points.points))
    for viewer, camera in after.cameras.items():
        if before.cameras.get(viewer) is not camera:
            yield _piece(f"camera/{viewer}", _camera(viewer, camera))
    if after.posture is not None and before.posture is not after.posture:
        said = after.posture
        yield _piece("posture", wire.PostureShape(said.label or "", round(said.margin, 2), _likeliest(said)))
    for viewer, preview in after.previews.items():
        if before.previews.get(viewer) is not preview:
            yield _piece(f"preview/{viewer}", wire.PreviewShape(viewer, preview.jpeg))


def views(after: State) -> Iterator[Piece]:
    """Each viewer's last silhouette, with the model in it."""
    for viewer, silhouette in after.silhouettes.items():
        yield _piece(f"view/{viewer}", _view(after, viewer, silhouette))


def rows(state: State, pages: int) -> Piece:
    """The services' health."""
    said = snapshot(state)
    logs = [row.health.counts for row in said.rows if row.service == "integrator" and row.health is not None]
    recording = None if not logs else any(counts.get("log_on") and not counts.get("log_stopped") for counts in logs)
    written = max((counts.get("log_messages", 0) for counts in logs), default=0)
    return _piece("rows", wire.Rows([_row(row) for row in said.rows], recording, written, pages))


def checks(state: State) -> Piece:
    """What to put right before the body can be measured."""
    found: dict[str, list[wire.Check]] = {}
    for (service, id), heard in state.services.items():
        if service == "viewer":
            words = heard.health.state if heard.health else "not there yet"
            found[id] = [wire.Check(*one) for one in (_scene(words), *_seen(state, id))]
    advice = next(
        (
            heard.health.state
            for (service, _), heard in reversed(list(state.services.items()))
            if service in ("integrator", "tracker") and heard.health and not heard.health.state.startswith("method")
        ),
        "waiting for the integrator",
    )
    return _piece("checks", wire.SettingUp(found, advice))


def _piece(name: str, shown: wire.Shown) -> Piece:
    return Piece(name, wire.encode(shown))


def _flat(array: Floats, decimals: int) -> list[float]:
    values: list[float] = np.round(array, decimals).ravel().tolist()
    return values


def _body(source: str, body: Body) -> wire.BodyShape:
    shapes = capsules(body.bdp)
    upright = figure(body.anatomy, body.bdp, neutral_pose(body.anatomy, np.zeros(3)))
    return wire.BodyShape(
        source, list(body.anatomy.parts), _flat(shapes.lengths, FINE), _flat(shapes.near, FINE), _flat(shapes.far, FINE),
        [marker.name for marker in body.anatomy.markers], list(body.anatomy.angles),
        round(float(np.ptp(upright.centres[:, 1])), MILLIMETRES),
    )  # fmt: skip


def _pose(actor: Actor) -> wire.PoseShape:
    placed = figure(actor.anatomy, actor.body, actor.pose)
    return wire.PoseShape(
        actor.source, actor.frame, actor.captured_ns / 1e6, actor.received_ns / 1e6,
        _flat(placed.positions, MILLIMETRES), _flat(placed.quaternions, FINE), _flat(placed.centres, MILLIMETRES),
        _flat(np.degrees(actor.pose.angles), TENTHS), list(actor.lost),
    )  # fmt: skip


def _camera(viewer: str, camera: Camera) -> wire.CameraShape:
    width, height = camera.size
    corners = np.array([[-0.5, -0.5], [width - 0.5, -0.5], [width - 0.5, height - 0.5], [-0.5, height - 0.5]])
    local = np.column_stack([corners, np.ones(4)]) @ np.linalg.inv(camera.matrix).T
    world = local @ camera.rotation + camera.centre
    return wire.CameraShape(viewer, camera.name, camera.size, _flat(camera.centre, FINE), _flat(world, FINE))


def _view(state: State, viewer: str, silhouette: m.Silhouette) -> wire.ViewShape:
    camera = state.cameras.get(viewer)
    drawn: dict[str, list[wire.Outline]] = {}
    if camera is not None and camera.size == silhouette.size:
        for source, actor in state.actors.items():
            if "person" not in actor.lost:
                found = outlines(actor.anatomy, actor.body, actor.pose, camera)
                drawn[source] = [wire.Outline(part, _flat(corners, TENTHS)) for part, corners in found]
    sighting = state.sightings.get(viewer)
    assigned = state.assignment.views.get(viewer) if state.assignment else None
    return wire.ViewShape(
        viewer, silhouette.size, silhouette.region, silhouette.data, drawn, assigned.view if assigned else "",
        round(sighting.score, 3) if sighting and sighting.score else None,
    )  # fmt: skip


def _likeliest(posture: m.Posture) -> list[tuple[str, float]]:
    """The best models and their log-likelihoods, best first."""
    best = sorted(posture.log_likelihoods.items(), key=lambda pair: -pair[1])[:LIKELIEST]
    return [(label, round(value, 1)) for label, value in best]


def _row(row: Row) -> wire.ServiceRow:
    health = row.health
    if health is None:
        return wire.ServiceRow(row.service, row.id, row.condition, row.silent_ns / 1e9, "", 0.0, None, 0, None, 0.0)
    age = next((health.stages_ms[stage] for stage in AGES if stage in health.stages_ms), None)
    offset_ms = health.clock_offset_ns / 1e6 if health.clock_error_ns else None
    return wire.ServiceRow(
        row.service, row.id, row.condition, round(row.silent_ns / 1e9, 1), health.state, round(health.rate, 1),
        None if age is None else round(age, 1), sum(health.counts.get(name, 0) for name in LOSSES),
        None if offset_ms is None else round(offset_ms, 3), round(health.memory_bytes / 1e6, 1),
    )  # fmt: skip


def _scene(words: str) -> Finding:
    """The background, as far as a viewer's words tell."""
    if words.startswith("learning the background"):
        return "background", "wait", f"{words}: keep the scene empty"
    return "background", "wait" if words == "not there yet" else "good", "learnt" if words != "not there yet" else words


def _seen(state: State, viewer: str) -> list[Finding]:
    silhouette = state.silhouettes.get(viewer)
    if silhouette is None:
        return [("person", "wait", "no silhouette yet")]
    try:
        mask = unpack(silhouette.size, silhouette.region, silhouette.data)
    except ValueError as problem:
        return [("silhouette", "bad", f"damaged: {problem}")]
    found = findings(shape_of(mask), _side(state, viewer))
    sighting = state.sightings.get(viewer)
    if sighting is not None and sighting.present and sighting.score:
        found.append(("fit", "good" if sighting.score > 0.5 else "bad", f"the model fits by {sighting.score:.2f} of 1"))
    return found


def _side(state: State, viewer: str) -> Literal["front", "side"] | None:
    """The side of the initial posture that a view is for; None when the body is known, or it is not said."""
    assignment = state.assignment
    if assignment is None or assignment.tracking or viewer not in assignment.views:
        return None
    return "front" if assignment.views[viewer].view == "facade" else "side"
