"""The animator's step: everything that is said on the rig becomes what is shown.  It publishes nothing."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeAlias, TypeVar

import numpy as np

from common import messages as m
from common.body.definition import Pose
from common.bus.protocol import Alive, Envelope, FrameLike, Tick
from common.conversion import anatomy_of, angles_of, bdp_of, camera_of, points_of
from services.animator.snapshot import Actor, Condition, Row, Snapshot, Source
from services.animator.states import MOST, SILENT_NS, STALE_NS, Body, Heard, Service, Setup, State

__all__ = ["counts", "describe", "initial_state", "snapshot", "step"]

Event = FrameLike | Envelope | Alive | Tick  # the loop's; the animator has no frames
Bap: TypeAlias = m.UniversalBap | m.TrackerPose
K = TypeVar("K")
V = TypeVar("V")


def initial_state(setup: Setup) -> State:
    return State(services={service: Heard() for service in setup.expected})


def step(setup: Setup, state: State, event: Event) -> tuple[State, list[m.Message]]:
    """One event.  Pure: the state depends on the arguments alone."""
    match event:
        case Tick(received_ns=now_ns):
            return replace(state, now_ns=now_ns), []
        case Alive():
            return _came_or_went(state, event), []
        case Envelope(message=message, received_ns=received_ns):
            return _hear(_noted(state, message, received_ns), message, received_ns), []
        case _:
            return state, []


def snapshot(state: State) -> Snapshot:
    """What is to be shown now."""
    rows = [
        Row(name, id, condition(state, (name, id)), max(0, state.now_ns - heard.heard_ns), heard.health)
        for (name, id), heard in state.services.items()
    ]
    return Snapshot(
        state.now_ns, state.actors, rows, state.silhouettes, state.sightings, state.previews, state.cameras,
        state.assignment, state.posture,
    )  # fmt: skip


def condition(state: State, service: Service) -> Condition:
    """Whether a service is there and says what it should."""
    heard = state.services[service]
    if heard.alive is False and heard.heard_ns <= heard.went_ns:
        return "gone"
    if not heard.heard_ns:
        return "starting"
    if state.now_ns - heard.heard_ns > SILENT_NS:
        return "stale"
    frames_stopped = heard.frame_ns and state.now_ns - heard.frame_ns > STALE_NS
    return "stale" if service[0] == "viewer" and frames_stopped else "well"


def describe(state: State) -> str:
    """What the animator is doing, for its health."""
    ill = [f"{name} {id}" for name, id in state.services if condition(state, (name, id)) in ("stale", "gone")]
    words = "showing " + " and ".join(state.actors) if state.actors else "waiting for a pose"
    return f"{words}; stale or gone: {', '.join(ill)}" if ill else words


def counts(state: State) -> Mapping[str, int]:
    return {"unusable": state.unusable}


def _came_or_went(state: State, event: Alive) -> State:
    service = (event.service, event.id)
    before = state.services.get(service, Heard())
    if event.alive:
        after = replace(before, alive=True, frame_ns=0 if before.alive is False else before.frame_ns)
    else:
        after = replace(before, alive=False, went_ns=event.received_ns)
    return replace(state, services=_with(state.services, service, after))


def _noted(state: State, message: m.Message, received_ns: int) -> State:
    """Who said it, and when."""
    service, of_a_frame = _sender(message)
    if service is None:
        return state
    heard = replace(state.services.get(service, Heard()), heard_ns=received_ns)
    if of_a_frame:
        heard = replace(heard, frame_ns=received_ns)
    if isinstance(message, m.Health):
        heard = replace(heard, health=message)
    return replace(state, now_ns=max(state.now_ns, received_ns), services=_with(state.services, service, heard))


def _sender(message: m.Message) -> tuple[Service | None, bool]:
    """The service that says a message, and whether it does with every frame."""
    match message:
        case m.Health(service=service, id=id):
            return (service, id), False
        case m.Sighting(viewer=viewer) | m.Silhouette(viewer=viewer) | m.PartialBap(viewer=viewer):
            return ("viewer", viewer), True
        case m.PartialBdp(viewer=viewer) | m.Preview(viewer=viewer):
            return ("viewer", viewer), False
        case m.Assignment() | m.UniversalBap():
            return ("integrator", "main"), True
        case m.TrackerPose() | m.ScenePoints():
            return ("tracker", "main"), True
        case m.Posture():
            return ("recognizer", "main"), False
        case _:  # the last value of a KEPT topic may come from a cache, long after it was said
            return None, False


def _hear(state: State, message: m.Message, received_ns: int) -> State:
    match message:
        case m.UniversalBdp(body=body):
            return _body(state, "two-view", body)
        case m.TrackerBdp(body=body):
            return _body(state, "tracker", body)
        case m.UniversalBap(lost=lost):
            return _pose(state, "two-view", message, tuple(lost), received_ns)
        case m.TrackerPose(lost=lost):
            return _pose(state, "tracker", message, ("person",) if lost else (), received_ns)
        case m.Silhouette(viewer=viewer):
            return replace(state, silhouettes=_with(state.silhouettes, viewer, message))
        case m.Sighting(viewer=viewer):
            return replace(state, sightings=_with(state.sightings, viewer, message))
        case m.Preview(viewer=viewer):
            return replace(state, previews=_with(state.previews, viewer, message))
        case m.CameraInfo():
            return _camera(state, message)
        case m.Assignment(tracking=tracking):
            return replace(state if tracking else _measured_anew(state), assignment=message)
        case m.Posture():
            return replace(state, posture=message)
        case m.ScenePoints():
            return _points(state, message)
        case _:
            return state


def _measured_anew(state: State) -> State:
    """The integrator knows no body any more: what is shown is the person of before."""
    actor = state.actors.get("two-view")
    if actor is None or "person" in actor.lost:
        return state
    return replace(state, actors=_with(state.actors, "two-view", replace(actor, lost=("person",))))


def _camera(state: State, said: m.CameraInfo) -> State:
    try:
        return replace(state, cameras=_with(state.cameras, said.viewer, camera_of(said)))
    except ValueError:
        return replace(state, unusable=state.unusable + 1)


def _points(state: State, said: m.ScenePoints) -> State:
    try:
        points_of(said)
    except ValueError:
        return replace(state, unusable=state.unusable + 1)
    return replace(state, points=said)


def _body(state: State, source: Source, said: m.Body) -> State:
    """A new body; the pose of the one before is not its own."""
    try:
        anatomy = anatomy_of(said)
        body = Body(anatomy, bdp_of(anatomy, said), said)
    except ValueError:
        return replace(state, unusable=state.unusable + 1)
    return replace(state, bodies=_with(state.bodies, source, body))


def _pose(state: State, source: Source, message: Bap, lost: tuple[str, ...], received_ns: int) -> State:
    body = state.bodies.get(source)
    if body is None:  # topics have no common order: the body may come after its first pose
        return state
    try:
        angles = angles_of(body.anatomy, message.angles, body.anatomy.neutral)
    except ValueError:
        return replace(state, unusable=state.unusable + 1)
    pose = Pose(np.array(message.position, dtype=np.float64), angles)
    actor = Actor(message.frame, message.captured_ns, received_ns, source, body.anatomy, body.bdp, pose, lost)
    return replace(state, actors=_with(state.actors, source, actor))


def _with(mapping: Mapping[K, V], key: K, value: V) -> Mapping[K, V]:
    """With one more, or another value; unchanged where there are MOST others: strangers' names must not fill the memory."""
    return {**mapping, key: value} if key in mapping or len(mapping) < MOST else mapping
