"""Step of the animator: every message of the rig updates the displayed state; publishes nothing."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

from zenocap.common import messages as m
from zenocap.common.bus.protocol import Alive, Envelope, FrameLike, Tick
from zenocap.common.conversion import camera_of, points_of
from zenocap.common.observe.bodies import posed
from zenocap.services.animator.parameters import COMMANDS_SHOWN, FRAME_TIMEOUT_NS, MAX_ENTRIES, MESSAGE_TIMEOUT_NS
from zenocap.services.animator.states import (
    Actor,
    Condition,
    Service,
    ServiceRecord,
    ServiceStatus,
    Setup,
    State,
)

Event = FrameLike | Envelope | Alive | Tick  # of the service loop; the animator has no frames
K = TypeVar("K")
V = TypeVar("V")


def initial_state(setup: Setup) -> State:
    return State(services={service: ServiceRecord() for service in setup.expected})


def step(setup: Setup, state: State, event: Event) -> tuple[State, list[m.Message]]:
    """Return the state after one event, and no messages.  Pure: the result depends on the arguments alone."""
    match event:
        case Tick(received_ns=now_ns):
            return replace(state, now_ns=now_ns), []
        case Alive():
            return _update_liveliness(state, event), []
        case Envelope(message=message, received_ns=received_ns):
            if not _is_admitted(setup, state, message):
                return state, []
            return _update_content(_update_record(state, message, received_ns), message, received_ns), []
        case _:
            return state, []


def service_statuses(state: State) -> Sequence[ServiceStatus]:
    """Status of every service, the expected ones first."""
    return [
        ServiceStatus(name, id, condition(state, (name, id)), max(0, state.now_ns - record.received_ns), record.health)
        for (name, id), record in state.services.items()
    ]


def condition(state: State, service: Service) -> Condition:
    """Condition of a service: alive, and publishing in time."""
    record = state.services[service]
    if record.alive is False and record.received_ns <= record.gone_ns:
        return "gone"
    if not record.received_ns:
        return "starting"
    if state.now_ns - record.received_ns > MESSAGE_TIMEOUT_NS:
        return "stale"
    frames_stopped = record.frame_ns and state.now_ns - record.frame_ns > FRAME_TIMEOUT_NS
    return "stale" if service[0] == "viewer" and frames_stopped else "ok"


def phase_of(state: State) -> m.Phase:
    """Phase of the animator, for its health."""
    return m.Phase.RUNNING if state.actors else m.Phase.WAITING_FOR_INPUT


def describe(state: State) -> str:
    """Health text of the animator."""
    missing = [f"{name} {id}" for name, id in state.services if condition(state, (name, id)) in ("stale", "gone")]
    text = "showing " + " and ".join(state.actors) if state.actors else "waiting for a pose"
    return f"{text}; stale or gone: {', '.join(missing)}" if missing else text


def counts(state: State) -> Mapping[str, int]:
    """Counters for the animator's health."""
    return {"unusable": state.unusable}


def _update_liveliness(state: State, event: Alive) -> State:
    service = (event.service, event.id)
    before = state.services.get(service, ServiceRecord())
    if event.alive:
        after = replace(before, alive=True, frame_ns=0 if before.alive is False else before.frame_ns)
    else:
        after = replace(before, alive=False, gone_ns=event.received_ns)
    return replace(state, services=_with(state.services, service, after))


def _update_record(state: State, message: m.Message, received_ns: int) -> State:
    """Record the sender and time of a message."""
    service, per_frame = _sender(message)
    if service is None:
        return state
    record = replace(state.services.get(service, ServiceRecord()), received_ns=received_ns)
    if per_frame:
        record = replace(record, frame_ns=received_ns)
    if isinstance(message, m.Health):
        record = replace(record, health=message)
    return replace(state, now_ns=max(state.now_ns, received_ns), services=_with(state.services, service, record))


def _sender(message: m.Message) -> tuple[Service | None, bool]:
    """Return the service that publishes a message, None if unknown, and whether it does so with every frame."""
    match message:
        case m.Health(service=service, id=id):
            return (service, id), False
        case m.Sighting(viewer=viewer) | m.Silhouette(viewer=viewer) | m.PartialBap(viewer=viewer):
            return ("viewer", viewer), True
        case m.PartialBdp(viewer=viewer) | m.Preview(viewer=viewer) | m.CameraAdvice(viewer=viewer):
            return ("viewer", viewer), False
        case m.Assignment() | m.UniversalBap():
            return ("integrator", "main"), True
        case m.TrackerPose() | m.ScenePoints():
            return ("tracker", "main"), True
        case m.Posture() | m.CommandResult():
            return ("recognizer", "main"), False
        case _:  # a latched value may be much older than its receipt
            return None, False


def _is_admitted(setup: Setup, state: State, message: m.Message) -> bool:
    """Whether a message is shown: half of MAX_ENTRIES is for viewers that the rig does not name, the rest for its own."""
    viewer = getattr(message, "viewer", None)
    if viewer is None or ("viewer", viewer) in setup.expected:
        return True
    shown: tuple[Mapping[str, object], ...] = (
        state.silhouettes,
        state.sightings,
        state.previews,
        state.advice,
        state.cameras,
    )
    return any(viewer in views for views in shown) or max(map(len, shown)) < MAX_ENTRIES // 2


def _update_content(state: State, message: m.Message, received_ns: int) -> State:
    match message:
        case m.UniversalBdp() | m.TrackerBdp() | m.UniversalBap() | m.TrackerPose():
            return _update_actor(state, message, received_ns)
        case m.Silhouette(viewer=viewer):
            return replace(state, silhouettes=_with(state.silhouettes, viewer, message))
        case m.Sighting(viewer=viewer):
            return replace(state, sightings=_with(state.sightings, viewer, message))
        case m.Preview(viewer=viewer):
            return replace(state, previews=_with(state.previews, viewer, message))
        case m.CameraAdvice(viewer=viewer):
            return replace(state, advice=_with(state.advice, viewer, message))
        case m.CameraInfo():
            return _update_camera(state, message)
        case m.Assignment(tracking=tracking):
            return replace(state if tracking else _mark_lost(state), assignment=message)
        case m.Posture():
            return replace(state, posture=message)
        case m.CommandResult():
            return replace(state, commands=(*state.commands, message)[-COMMANDS_SHOWN:])
        case m.ScenePoints():
            return _update_points(state, message)
        case m.FrameRate():
            return replace(state, frame_rate=message)
        case m.TrackerDetail(share=share):
            return replace(state, detail=share)
        case _:
            return state


def _mark_lost(state: State) -> State:
    """Mark the two-view actor as lost: the integrator is measuring a new body, so its last pose is of the previous one."""
    actor = state.actors.get("two-view")
    if actor is None or "person" in actor.lost:
        return state
    return replace(state, actors=_with(state.actors, "two-view", replace(actor, lost=("person",))))


def _update_camera(state: State, message: m.CameraInfo) -> State:
    try:
        return replace(state, cameras=_with(state.cameras, message.viewer, camera_of(message)))
    except ValueError:
        return replace(state, unusable=state.unusable + 1)


def _update_points(state: State, message: m.ScenePoints) -> State:
    try:
        points_of(message)
    except ValueError:
        return replace(state, unusable=state.unusable + 1)
    return replace(state, points=message)


def _update_actor(state: State, message: m.Message, received_ns: int) -> State:
    """Update the body of a source, or its pose."""
    try:
        bodies, found = posed(state.bodies, message)
    except ValueError:
        return replace(state, unusable=state.unusable + 1)
    if found is None:  # also a pose before its body: order across topics is not guaranteed
        return state if bodies is state.bodies else replace(state, bodies=bodies)
    bap, source = found.message, found.source
    actor = Actor(bap.frame, bap.captured_ns, received_ns, source, found.anatomy, found.body, found.pose, found.lost)
    return replace(state, actors=_with(state.actors, source, actor))


def _with(mapping: Mapping[K, V], key: K, value: V) -> Mapping[K, V]:
    """Return the mapping with one value set; unchanged for a new key beyond MAX_ENTRIES, which bounds the memory."""
    return {**mapping, key: value} if key in mapping or len(mapping) < MAX_ENTRIES else mapping
