"""State recovery of the integrator and of viewers without a body."""

from dataclasses import replace

import numpy as np

from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.conversion import angles_of, bdp_of
from zenocap.common.messages import Message, Sighting, UniversalBap, UniversalBdp
from zenocap.common.synchronizer import FrameSet
from zenocap.services.integrator.parameters import REMINDER_NS
from zenocap.services.integrator.states import AssignedRootPose, IntegratedPerson, IntegratorSetup, IntegratorState
from zenocap.services.integrator.two_view.arbitrator import View


def resume(
    setup: IntegratorSetup, state: IntegratorState, message: UniversalBdp | UniversalBap
) -> tuple[IntegratorState, list[Message]]:
    """Recover the body, then the pose, that were published before a restart; the pose resumes tracking.

    Recovered messages are published again, for late joiners, for viewers that have lost them, and for the take.
    """
    match message:
        case UniversalBdp() if state.published_body is None and _is_usable(setup.anatomy, message):
            return replace(state, published_body=message), [message]
        case UniversalBap() if state.published_body is not None and set(message.views) == set(setup.cameras):
            bdp = bdp_of(setup.anatomy, state.published_body.body)
            pose = Pose(np.array(message.position), angles_of(setup.anatomy, message.angles, setup.anatomy.neutral))
            yaw, lean, roll = (float(pose.angles[setup.anatomy.index[f"navel.{axis}"]]) for axis in "yxz")
            views: dict[str, View] = dict(message.views)
            placed = AssignedRootPose(message.captured_ns, pose.position, yaw, lean, roll, False, views, ())
            person = IntegratedPerson(bdp, pose, (placed,), standing_height(setup.anatomy, bdp))
            return replace(state, person=person, views=views, bodies=(), problem=""), [message]
        case _:
            return state, []


def standing_height(anatomy: Anatomy, bdp: Bdp) -> float:
    """Height of the navel of an upright person, metres: height of the hips in the torso and lengths of the legs."""
    hip = next(k for k, joint in enumerate(anatomy.joints) if joint.name == "right_hip")
    legs = sum(
        float(bdp.sizes[k][0]) for k, part in enumerate(anatomy.parts) if part in ("right_upper_leg", "right_lower_leg")
    )
    return legs - float(bdp.offsets[hip][1])


def _is_usable(anatomy: Anatomy, message: UniversalBdp) -> bool:
    """True for a body of this anatomy within its limits."""
    try:
        bdp_of(anatomy, message.body)
    except ValueError:
        return False
    return True


def note_answer(state: IntegratorState, viewer: str, captured_ns: int) -> IntegratorState:
    """Record that a viewer has published a partial BAP of this time."""
    if viewer not in state.sightings.viewers:
        return state
    return replace(state, answered={**state.answered, viewer: captured_ns})


def republish_body(state: IntegratorState, frames: FrameSet[Sighting]) -> tuple[IntegratorState, list[Message]]:
    """Publish the universal BDP again if a viewer sees the person but has published no partial BAPs for REMINDER_NS.

    Such a viewer has restarted and does not have the body.
    """
    body = state.published_body
    if state.person is None or body is None:
        return state, []
    now_ns = frames.captured_ns
    answered = {viewer: state.answered.get(viewer, now_ns) for viewer, sighting in frames.items.items() if sighting.present}
    overdue = {viewer: now_ns for viewer, last_ns in answered.items() if abs(now_ns - last_ns) > REMINDER_NS}
    state = replace(state, answered={**state.answered, **answered, **overdue})
    return state, [body] if overdue else []


def note_body(state: IntegratorState, message: UniversalBdp) -> IntegratorState:
    """Note a body that is not the published one: viewers use the last one that they receive."""
    own = state.published_body
    return state if own is None or message.body == own.body else replace(state, contradicted=True)


def contradict_body(state: IntegratorState) -> tuple[IntegratorState, list[Message]]:
    """Publish the universal BDP again after another one."""
    if not state.contradicted or state.published_body is None:
        return state, []
    return replace(state, contradicted=False), [state.published_body]
