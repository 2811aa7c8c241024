"""Step of the animator: every message of the rig updates the displayed state; publishes nothing."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

from zenocap.common import messages as m
from zenocap.common.bus.protocol import Alive, Envelope, FrameLike, Tick
from zenocap.common.conversion import camera_of, points_of
from zenocap.common.observe.bodies import posed
from zenocap.common.runtime.frame_rate import is_overtaken
from zenocap.services.animator.parameters import COMMANDS_SHOWN, MAX_ENTRIES
from zenocap.services.animator.states import ActorPose, AnimatorSetup, AnimatorState

Event = FrameLike | Envelope | Alive | Tick  # of the service loop; the animator has no frames
K = TypeVar("K")
V = TypeVar("V")


def step(setup: AnimatorSetup, state: AnimatorState, event: Event) -> tuple[AnimatorState, list[m.Message]]:
    """Return the state after one event, and no messages.  Pure: the result depends on the arguments alone."""
    match event:
        case Tick(received_ns=now_ns):
            return replace(state, now_ns=now_ns), []
        case Envelope(message=message, received_ns=received_ns) if _is_admitted(setup, state, message):
            state = replace(state, now_ns=max(state.now_ns, received_ns))
            try:
                return _updated(setup, state, message, received_ns), []
            except ValueError:
                return replace(state, unusable=state.unusable + 1), []
        case _:
            return state, []


def phase_of(state: AnimatorState) -> m.Phase:
    """Phase of the animator, for its health."""
    return m.Phase.RUNNING if state.actors else m.Phase.WAITING_FOR_INPUT


def describe(state: AnimatorState) -> str:
    """Health text of the animator."""
    return "showing " + " and ".join(state.actors) if state.actors else "waiting for a pose"


def counts(state: AnimatorState) -> Mapping[str, int]:
    """Counters for the animator's health."""
    return {"unusable": state.unusable}


def _is_admitted(setup: AnimatorSetup, state: AnimatorState, message: m.Message) -> bool:
    """Whether a message is shown: half of MAX_ENTRIES is for viewers that the rig does not name, the rest for its own."""
    viewer = getattr(message, "viewer", None)
    if viewer is None or viewer in setup.viewers:
        return True
    shown: tuple[Mapping[str, object], ...] = (
        state.silhouettes, state.sightings, state.previews, state.advice, state.cameras,
    )  # fmt: skip
    return any(viewer in views for views in shown) or max(map(len, shown)) < MAX_ENTRIES // 2


def _updated(setup: AnimatorSetup, state: AnimatorState, message: m.Message, received_ns: int) -> AnimatorState:
    """The state with the content of a message.  Raises ValueError for one that cannot be used."""
    match message:
        case m.UniversalBdp() | m.TrackerBdp() | m.UniversalBap() | m.TrackerPose():
            return _update_actor(state, message, received_ns)
        case m.CameraInfo(viewer=viewer, captured_ns=start_ns):
            cameras = _with(state.cameras, viewer, camera_of(message))
            return replace(state, cameras=cameras, start_ns=start_ns if viewer in setup.viewers else state.start_ns)
        case m.Silhouette() | m.Sighting() | m.Preview() | m.CameraAdvice():
            return _update_viewer(state, message)
        case m.Assignment(tracking=tracking):
            return replace(state if tracking else _mark_lost(state), assignment=message)
        case m.Posture():
            return replace(state, posture=message)
        case m.CommandResult():
            return replace(state, commands=(*state.commands, message)[-COMMANDS_SHOWN:])
        case m.ScenePoints():
            points_of(message)
            return replace(state, points=message)
        case m.FrameRate():  # the one that viewers follow
            return state if is_overtaken(message, state.frame_rate) else replace(state, frame_rate=message)
        case m.TrackerDetail(share=share):
            return replace(state, detail=share)
        case _:
            return state


def _update_viewer(state: AnimatorState, message: m.Silhouette | m.Sighting | m.Preview | m.CameraAdvice) -> AnimatorState:
    """The state with what a viewer sees.  Raises ValueError."""
    match message:
        case m.Silhouette(viewer=viewer):
            return replace(state, silhouettes=_with(state.silhouettes, viewer, message))
        case m.Sighting(viewer=viewer):
            return replace(state, sightings=_with(state.sightings, viewer, message))
        case m.Preview(viewer=viewer):
            return replace(state, previews=_with(state.previews, viewer, message))
        case m.CameraAdvice(viewer=viewer):
            return replace(state, advice=_with(state.advice, viewer, message))


def _mark_lost(state: AnimatorState) -> AnimatorState:
    """Mark the two-view actor as lost: the integrator is measuring a new body, so its last pose is of the previous one."""
    actor = state.actors.get("two-view")
    if actor is None or "person" in actor.lost:
        return state
    return replace(state, actors=_with(state.actors, "two-view", replace(actor, lost=("person",))))


def _update_actor(state: AnimatorState, message: m.Message, received_ns: int) -> AnimatorState:
    """Update the body of a source, or its pose.  Raises ValueError."""
    bodies, found = posed(state.bodies, message)
    if found is None:  # also a pose before its body: order across topics is not guaranteed
        return state if bodies is state.bodies else replace(state, bodies=bodies)
    bap, source = found.message, found.source
    actor = ActorPose(bap.frame, bap.captured_ns, received_ns, source, found.anatomy, found.body, found.pose, found.lost)
    return replace(state, actors=_with(state.actors, source, actor))


def _with(mapping: Mapping[K, V], key: K, value: V) -> Mapping[K, V]:
    """Return the mapping with one value set; unchanged for a new key beyond MAX_ENTRIES, which bounds the memory."""
    return {**mapping, key: value} if key in mapping or len(mapping) < MAX_ENTRIES else mapping
