"""Step of a two-view viewer: frames and assignments in; sightings and BAPs out.  [Fig. 1]"""

from dataclasses import replace

import numpy as np

from zenocap.common.body.definition import Bdp, Pose, neutral_pose
from zenocap.common.body.proportions import PAPER_TORSO_SHARE, TORSO_SHARE
from zenocap.common.body.segments import torso_rotation
from zenocap.common.bus.protocol import Alive, Envelope, Tick
from zenocap.common.conversion import angles_of, bdp_of
from zenocap.common.messages import Assignment, Message, PartialBdp, Phase, Sighting, UniversalBap, UniversalBdp
from zenocap.services.viewer.frame import Frame, SegmentedFrame, silhouette_message
from zenocap.services.viewer.parameters import UNPLACED_NS
from zenocap.services.viewer.segmentation import learn, segment
from zenocap.services.viewer.states import Segmentation
from zenocap.services.viewer.two_view.body_definition import Scale, fine_tuned, side_lengths
from zenocap.services.viewer.two_view.body_fit import body_model
from zenocap.services.viewer.two_view.paper.body_definition import fine_tuned as paper_fine_tuned
from zenocap.services.viewer.two_view.paper.body_definition import side_lengths as paper_side_lengths
from zenocap.services.viewer.two_view.silhouette_features import is_front_posture, is_side_posture, silhouette_box
from zenocap.services.viewer.two_view.states import (
    EarlyPose,
    LearningWithBody,
    MeasuringBody,
    Pending,
    TrackingBody,
    TwoViewSetup,
    TwoViewState,
)
from zenocap.services.viewer.two_view.tracking import limbs, sighting

Event = Frame | SegmentedFrame | Envelope | Alive | Tick
AWAITING_POSE = "waiting for the pose of the integrator"


def initial_state(setup: TwoViewSetup) -> TwoViewState:
    return LearningWithBody()


def step(setup: TwoViewSetup, state: TwoViewState, event: Event) -> tuple[TwoViewState, list[Message]]:
    """Process one event: (state, messages).  Pure."""
    match state, event:
        case LearningWithBody(), Frame() | SegmentedFrame():
            return _learn(setup, state, event)
        case ((MeasuringBody() | TrackingBody()), Frame()):
            return _segment(setup, state, event)
        case ((MeasuringBody() | TrackingBody()), SegmentedFrame()):
            return _locate(setup, state, event)
        case _, Envelope(message=message):
            return _receive(setup, state, message)
        case _:
            return state, []


def phase_of(state: TwoViewState) -> Phase:
    """Phase of the viewer, for its health."""
    match state:
        case LearningWithBody():
            return Phase.LEARNING_BACKGROUND
        case MeasuringBody(scene=scene):
            return Phase.AWAITING_PERSON if scene.extents is None else Phase.MEASURING_BODY
        case TrackingBody():
            return Phase.TRACKING


def answered_frame(id: str, message: Message) -> int | None:
    """Number of the frame of viewer `id` that an assignment of a complete frame set answers; None for other messages."""
    match message:
        case Assignment(views=views) if id in views and not any(view.stale for view in views.values()):
            return views[id].frame
        case _:
            return None


def describe(state: TwoViewState) -> str:
    """Health text of a state."""
    match state:
        case LearningWithBody(seen=seen):
            return f"learning the background ({seen} frames)"
        case MeasuringBody(advice=advice):
            return advice
        case TrackingBody(lost=lost):
            return "tracking, limbs lost: searching all around" if lost else "tracking"


def _learn(
    setup: TwoViewSetup, state: LearningWithBody, frame: Frame | SegmentedFrame
) -> tuple[TwoViewState, list[Message]]:
    state, scene = learn(setup, state, frame.image if isinstance(frame, Frame) else None)
    if scene is None:
        return state, []
    return MeasuringBody(scene, state.bdp), []


def _segment(setup: TwoViewSetup, state: MeasuringBody | TrackingBody, frame: Frame) -> tuple[TwoViewState, list[Message]]:
    """Sighting of an image."""
    scene, mask, messages = segment(setup, state.scene, frame)
    if mask is not None and setup.publish_silhouette:
        messages.append(silhouette_message(setup.id, setup.camera.size, frame, mask))
    located = SegmentedFrame(frame.frame, frame.captured_ns, mask)
    after, more = _locate(setup, replace(state, scene=scene), located)
    return after, [*messages, *more]


def _locate(
    setup: TwoViewSetup, state: MeasuringBody | TrackingBody, frame: SegmentedFrame
) -> tuple[TwoViewState, list[Message]]:
    """Sighting of a silhouette.  A take contains all inputs from here on: `zenocap verify` recomputes this part."""
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
    if isinstance(state, TrackingBody):
        state = _expire_pose(state, frame.captured_ns)
    match state:
        case TrackingBody():
            tracked, message = sighting(setup, state, pending)
            return tracked, [message]
        case MeasuringBody():
            return replace(state, pending=pending), [_first_sighting(setup, pending)]


def _expire_pose(state: TrackingBody, captured_ns: int) -> TrackingBody | MeasuringBody:
    """Drop a pose without assignments for UNPLACED_NS: sightings searched from a wrong pose cannot be placed."""
    if state.placed_ns is None:
        return replace(state, placed_ns=captured_ns)
    if abs(captured_ns - state.placed_ns) > UNPLACED_NS:
        return MeasuringBody(state.scene, state.bdp, advice=AWAITING_POSE)
    return state


def _first_sighting(setup: TwoViewSetup, pending: Pending) -> Sighting:
    """Sighting before a body is known, from the columns of the torso and the hip height by body proportions."""
    box = silhouette_box(pending.mask)
    focal = setup.level.focal_px()
    cx, cy = setup.level.centre_px()
    return Sighting(
        frame=pending.frame, captured_ns=pending.captured_ns, viewer=setup.id, present=True,
        x=(box.column - cx) / focal, y=(box.navel_row - cy) / focal, height=box.height / focal,
        width=box.width / focal, view="facade" if is_front_posture(box) else "flank", score=0.0,
    )  # fmt: skip


def _receive(setup: TwoViewSetup, state: TwoViewState, message: Message) -> tuple[TwoViewState, list[Message]]:
    """Process a message of the integrator."""
    match state, message:
        case MeasuringBody(pending=Pending() as pending), Assignment(tracking=False):
            if _is_for(setup, pending, message):
                return _measure(setup, state, pending, message)
        case LearningWithBody(), UniversalBdp():  # this viewer has restarted while the others track
            return replace(state, bdp=bdp_of(setup.anatomy, message.body)), []
        case MeasuringBody(early=early), UniversalBdp():
            bdp = bdp_of(setup.anatomy, message.body)
            if early is None:
                return replace(state, bdp=bdp, advice=AWAITING_POSE), []
            return _tracking(setup, state.scene, bdp, early.pose, early.based_on), []
        case MeasuringBody(bdp=None), UniversalBap():  # topics are not ordered: a body may follow its pose
            return replace(state, early=EarlyPose(_pose(setup, message), message.frame)), []
        case MeasuringBody(bdp=Bdp() as bdp), UniversalBap():
            return _tracking(setup, state.scene, bdp, _pose(setup, message), message.frame), []
        case MeasuringBody(bdp=Bdp() as bdp), Assignment(tracking=True):  # no pose, or an expired one: start upright
            pose = neutral_pose(setup.anatomy, np.array(message.position), message.yaw)
            return _tracking(setup, state.scene, bdp, pose), []
        case TrackingBody(), _:
            return _receive_tracking(setup, state, message)
    return state, []


def _receive_tracking(setup: TwoViewSetup, state: TrackingBody, message: Message) -> tuple[TwoViewState, list[Message]]:
    match message:
        case Assignment(tracking=True) if state.pending is not None:
            pending = state.pending
            state = replace(state, placed_ns=pending.captured_ns)
            return limbs(setup, state, pending, message) if _is_for(setup, pending, message) else (state, [])
        case Assignment(tracking=False):  # the integrator has restarted without a body
            return MeasuringBody(state.scene, state.bdp), []
        case UniversalBdp():
            bdp = bdp_of(setup.anatomy, message.body)
            return replace(state, bdp=bdp, model=body_model(setup.anatomy, bdp)), []
        case UniversalBap():
            return replace(state, pose=_pose(setup, message), based_on=message.frame), []
    return state, []


def _tracking(setup: TwoViewSetup, scene: Segmentation, bdp: Bdp, pose: Pose, based_on: int = -1) -> TrackingBody:
    return TrackingBody(scene, bdp, body_model(setup.anatomy, bdp), pose, based_on)


def _is_for(setup: TwoViewSetup, pending: Pending, assignment: Assignment) -> bool:
    """True when the assignment is for the pending frame; compares frame numbers, since its time is on another clock."""
    own_view = assignment.views.get(setup.id)
    return own_view is not None and not own_view.stale and own_view.frame == pending.frame


def _pose(setup: TwoViewSetup, message: UniversalBap) -> Pose:
    angles = angles_of(setup.anatomy, message.angles, setup.anatomy.neutral)
    return Pose(np.array(message.position), angles)


def _measure(
    setup: TwoViewSetup, state: MeasuringBody, pending: Pending, assignment: Assignment
) -> tuple[TwoViewState, list[Message]]:
    """Partial BDP of the pending frame if it shows this view of the T-pose; otherwise advice."""
    box = silhouette_box(pending.mask)
    position = np.array(assignment.position)
    is_front = assignment.views[setup.id].view == "facade"
    depth = float(setup.rows[2] @ position + setup.rows[3, 2])
    try:
        if is_front:
            if not is_front_posture(box):
                raise ValueError("hold the T-pose, facing this camera")
            there = pending.mask, setup.rows, position, torso_rotation(assignment.yaw, 0.0, 0.0)
            if "body" in setup.additions:
                lengths = fine_tuned(setup.anatomy, *there)
            else:
                share = TORSO_SHARE if "proportions" in setup.additions else PAPER_TORSO_SHARE
                lengths = paper_fine_tuned(setup.anatomy, *there, share)
        else:
            if not is_side_posture(box):
                raise ValueError("hold the T-pose, side-on to this camera")
            scale = Scale(depth, setup.level.focal_px(), setup.level.centre_px()[1])
            if "body" in setup.additions:
                lengths = side_lengths(pending.mask, scale)
            else:
                lengths = paper_side_lengths(pending.mask, scale.metres_per_px)
    except ValueError as error:
        return replace(state, pending=None, advice=str(error)), []
    partial = PartialBdp(
        frame=pending.frame, captured_ns=pending.captured_ns, viewer=setup.id, side="front" if is_front else "side",
        lengths={name: float(length) for name, length in lengths.items()},
    )  # fmt: skip
    return replace(state, pending=None, advice="measuring the body: stand still"), [partial]
