"""A viewer's step: frames and the integrator's answers in; sightings, partial BDPs and BAPs out.  [Two-view Fig. 1]"""

from dataclasses import replace

import numpy as np

from common.body.definition import Bdp, Pose, neutral_pose
from common.body.torso import torso_rotation
from common.bus.protocol import Alive, Envelope, Tick
from common.conversion import angles_of, bdp_of
from common.messages import Assignment, Message, PartialBdp, Sighting, UniversalBap, UniversalBdp
from services.viewer.body_definition import Scale, side_lengths
from services.viewer.body_fit import body_model
from services.viewer.frame import Frame, Masked
from services.viewer.measuring import fine_tuned, looks_like_front, looks_like_side, outline
from services.viewer.seeing import learn, see, silhouette_message
from services.viewer.states import (
    Early,
    LearningBackground,
    MeasuringBody,
    Pending,
    Seen,
    Setup,
    State,
    Tracking,
    viewer_setup,
)  # fmt: skip
from services.viewer.tracking import limbs, sighting

__all__ = ["describe", "initial_state", "step", "viewer_setup"]

Event = Frame | Masked | Envelope | Alive | Tick
UNPLACED_NS = 3_000_000_000  # without an assignment, after which a viewer no longer believes the pose it had
AWAITING_POSE = "waiting for the integrator's pose"


def initial_state(setup: Setup) -> State:
    return LearningBackground()


def step(setup: Setup, state: State, event: Event) -> tuple[State, list[Message]]:
    """One event.  Pure: the state and the messages depend on the arguments alone."""
    match state, event:
        case LearningBackground(), Frame() | Masked():
            return _learn(setup, state, event)
        case ((MeasuringBody() | Tracking()), Frame()):
            return _see(setup, state, event)
        case ((MeasuringBody() | Tracking()), Masked()):
            return _sight(setup, state, event)
        case _, Envelope(message=message):
            return _hear(setup, state, message)
        case _:
            return state, []


def describe(state: State) -> str:
    """What the viewer is doing, for its health."""
    match state:
        case LearningBackground(frames=frames):
            return f"learning the background ({len(frames)} frames)"
        case MeasuringBody(advice=advice):
            return advice
        case Tracking(lost=lost):
            return "tracking, searching more widely" if lost else "tracking"


def _learn(setup: Setup, state: LearningBackground, frame: Frame | Masked) -> tuple[State, list[Message]]:
    state, seen = learn(setup, state, frame.image if isinstance(frame, Frame) else None)
    if seen is None:
        return state, []
    return MeasuringBody(seen, state.bdp), []


def _see(setup: Setup, state: MeasuringBody | Tracking, frame: Frame) -> tuple[State, list[Message]]:
    """A frame becomes a silhouette, and that a sighting."""
    seen, mask, messages = see(setup, state.seen, frame)
    if mask is not None and setup.publish_silhouette:
        messages.append(silhouette_message(setup, frame, mask))
    after, more = _sight(setup, replace(state, seen=seen), Masked(frame.frame, frame.captured_ns, mask))
    return after, [*messages, *more]


def _sight(setup: Setup, state: MeasuringBody | Tracking, frame: Masked) -> tuple[State, list[Message]]:
    """A silhouette becomes a sighting.  From here on a take has all that decides: `replay --verify` begins here."""
    mask = None if frame.mask is None else setup.level.warp(frame.mask)
    if mask is None or not mask.any():
        absent = Sighting(
            frame=frame.frame, captured_ns=frame.captured_ns, viewer=setup.id, present=False, x=0.0, y=0.0, height=0.0,
            width=0.0, view="facade", score=0.0,
        )  # fmt: skip
        if isinstance(state, MeasuringBody):
            state = replace(state, advice="waiting for a person")
        return state, [absent]
    pending = Pending(frame.frame, frame.captured_ns, mask)
    if isinstance(state, Tracking):
        state = _still_placed(state, frame.captured_ns)
    match state:
        case Tracking():
            tracked, sight = sighting(setup, state, pending)
            return tracked, [sight]
        case MeasuringBody():
            return replace(state, pending=pending), [_first_sighting(setup, pending)]


def _still_placed(state: Tracking, captured_ns: int) -> Tracking | MeasuringBody:
    """Not for ever: nobody can place a body by sightings that come from a pose which is wrong."""
    if state.placed_ns is None:
        return replace(state, placed_ns=captured_ns)
    if abs(captured_ns - state.placed_ns) > UNPLACED_NS:
        return MeasuringBody(state.seen, state.bdp, advice=AWAITING_POSE)
    return state


def _first_sighting(setup: Setup, pending: Pending) -> Sighting:
    """Before the body is known: the torso's columns and the height of the hips by body proportions."""
    shape = outline(pending.mask)
    focal = setup.level.focal_px()
    cx, cy = setup.level.centre_px()
    return Sighting(
        frame=pending.frame, captured_ns=pending.captured_ns, viewer=setup.id, present=True,
        x=(shape.column - cx) / focal, y=(shape.navel_row - cy) / focal, height=shape.height / focal,
        width=shape.width / focal, view="facade" if looks_like_front(shape) else "flank", score=0.0,
    )  # fmt: skip


def _hear(setup: Setup, state: State, message: Message) -> tuple[State, list[Message]]:
    """The integrator's messages."""
    match state, message:
        case MeasuringBody(pending=Pending() as pending), Assignment(tracking=False):
            if _answers(setup, pending, message):
                return _measure(setup, state, pending, message)
        case Tracking(pending=Pending() as pending), Assignment(tracking=True):
            state = replace(state, placed_ns=pending.captured_ns)
            return limbs(setup, state, pending, message) if _answers(setup, pending, message) else (state, [])
        case Tracking(), Assignment(tracking=False):  # the integrator started anew and knows no body
            return MeasuringBody(state.seen, state.bdp), []
        case LearningBackground(), UniversalBdp():  # a viewer that comes back while the others track
            return replace(state, bdp=bdp_of(setup.anatomy, message.body)), []
        case MeasuringBody(early=early), UniversalBdp():
            bdp = bdp_of(setup.anatomy, message.body)
            if early is None:
                return replace(state, bdp=bdp, advice=AWAITING_POSE), []
            return _tracking(setup, state.seen, bdp, early.pose, early.based_on), []
        case MeasuringBody(bdp=None), UniversalBap():  # topics have no common order: the body may come after its first pose
            return replace(state, early=Early(_pose(setup, message), message.frame)), []
        case MeasuringBody(bdp=Bdp() as bdp), UniversalBap():
            return _tracking(setup, state.seen, bdp, _pose(setup, message), message.frame), []
        case MeasuringBody(bdp=Bdp() as bdp), Assignment(tracking=True):  # no pose came, or it was lost: begin upright
            pose = neutral_pose(setup.anatomy, np.array(message.position), message.yaw)
            return _tracking(setup, state.seen, bdp, pose), []
        case Tracking(), UniversalBdp():
            bdp = bdp_of(setup.anatomy, message.body)
            return replace(state, bdp=bdp, model=body_model(setup.anatomy, bdp)), []
        case Tracking(), UniversalBap():
            return replace(state, pose=_pose(setup, message), before=state.pose, based_on=message.frame), []
    return state, []


def _tracking(setup: Setup, seen: Seen, bdp: Bdp, pose: Pose, based_on: int = -1) -> Tracking:
    return Tracking(seen, bdp, body_model(setup.anatomy, bdp), pose, pose, based_on)


def _answers(setup: Setup, pending: Pending, assignment: Assignment) -> bool:
    """Whether the assignment is for the frame that waits; its time is on the integrator's clock, so frames count."""
    mine = assignment.views.get(setup.id)
    return mine is not None and not mine.stale and mine.frame == pending.frame


def _pose(setup: Setup, message: UniversalBap) -> Pose:
    angles = angles_of(setup.anatomy, message.angles, setup.anatomy.neutral)
    return Pose(np.array(message.position), angles)


def _measure(setup: Setup, state: MeasuringBody, pending: Pending, assignment: Assignment) -> tuple[State, list[Message]]:
    """Partial BDP, when this viewer sees its side of the initial posture."""
    shape = outline(pending.mask)
    position = np.array(assignment.position)
    is_front = assignment.views[setup.id].view == "facade"
    depth = float(setup.rows[2] @ position + setup.rows[3, 2])
    try:
        if is_front:
            if not looks_like_front(shape):
                raise ValueError("stretch both arms sideways, facing this camera")
            lengths = fine_tuned(
                setup.anatomy, pending.mask, setup.rows, position, torso_rotation(assignment.yaw, 0.0, 0.0)
            )
        else:
            if not looks_like_side(shape):
                raise ValueError("stand side on to this camera")
            lengths = side_lengths(pending.mask, Scale(depth, setup.level.focal_px(), setup.level.centre_px()[1]))
    except ValueError as problem:
        return replace(state, pending=None, advice=str(problem)), []
    partial = PartialBdp(
        frame=pending.frame, captured_ns=pending.captured_ns, viewer=setup.id, side="front" if is_front else "side",
        height_px=float(shape.height), score=0.0, lengths={name: float(length) for name, length in lengths.items()},
    )  # fmt: skip
    return replace(state, pending=None, advice="measuring the body: stand still"), [partial]
