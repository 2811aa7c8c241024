"""Universal BAP of a frame set: the limbs of both viewers on the assigned torso.  [Two-view 4.4]"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.definition import Pose
from zenocap.common.body.segments import (
    LIMBS,
    exchange_legs,
    hanging_arm,
    limb_angles,
    limb_directions,
    limbs_of,
    torso_rotation,
)
from zenocap.common.conversion import angles_by_name, angles_of
from zenocap.common.messages import Message, PartialBap, UniversalBap
from zenocap.common.synchronizer import FrameSet
from zenocap.services.integrator.states import AssignedRootPose, IntegratedPerson, IntegratorSetup, IntegratorState
from zenocap.services.integrator.two_view.initialization import point
from zenocap.services.integrator.two_view.integration import ViewedLimbs, exchange_evidence, integrate_limbs, select_angles


def pose_person(
    setup: IntegratorSetup, state: IntegratorState, frames: FrameSet[PartialBap]
) -> tuple[IntegratorState, list[Message]]:
    """Universal BAP of one frame set.  Without one viewer the other decides alone; the missing one is listed as stale."""
    person = state.person
    placed = _placed(setup, person, frames.captured_ns) if person else None
    if person is None or placed is None:
        return state, []
    torso = torso_rotation(placed.yaw, placed.lean, placed.roll)
    gains = [bap.exchange for bap in frames.items.values() if bap.view == "facade" and "exchange" in setup.additions]
    exchange, exchanged = exchange_evidence(person.exchange, gains[0]) if gains else (person.exchange, False)
    before = person.pose.angles.copy()
    index = setup.anatomy.index
    before[[index["navel.y"], index["navel.x"], index["navel.z"]]] = placed.yaw, placed.lean, placed.roll
    if "merging" in setup.additions:
        views = [_viewed(setup, placed, torso, person, viewer, bap) for viewer, bap in frames.items.items()]
        directions = integrate_limbs(views, hanging_arm(torso, placed.yaw), placed.squatting)
        angles = limb_angles(setup.anatomy, exchange_legs(directions) if exchanged else directions, before)
    else:
        angles = _selected(setup, person, placed, frames.items, before)
        if exchanged:
            angles = limb_angles(setup.anatomy, exchange_legs(limb_directions(setup.anatomy, angles)), angles)
    pose = Pose(placed.position, angles)
    state = replace(state, person=replace(person, pose=pose, exchange=exchange))
    # Paper (added): without one viewer the other continues alone.
    stale = [viewer for viewer in setup.cameras if viewer not in frames.items]
    first = next(iter(frames.items.values()))
    return state, [
        UniversalBap(
            frame=first.frame, captured_ns=frames.captured_ns, position=point(pose.position),
            angles=angles_by_name(setup.anatomy, angles),
            scores={viewer: bap.score for viewer, bap in frames.items.items()},
            views=dict(placed.views), stale=stale, lost=[],
        )
    ]  # fmt: skip


def _selected(
    setup: IntegratorSetup,
    person: IntegratedPerson,
    placed: AssignedRootPose,
    baps: Mapping[str, PartialBap],
    before: Floats,
) -> Floats:
    """(angles,) each from the view that determines it; `before` (angles,): all others."""
    by_view = {bap.view: angles_of(setup.anatomy, bap.angles, before) for bap in baps.values()}
    facade, flank = by_view.get("facade", before), by_view.get("flank", before)
    return select_angles(facade, flank, limbs_of(setup.anatomy), placed.squatting)


def _placed(setup: IntegratorSetup, person: IntegratedPerson, captured_ns: int) -> AssignedRootPose | None:
    """Assignment that partial BAPs of this time answer, or None."""
    near = [p for p in person.placed if abs(p.captured_ns - captured_ns) <= setup.frame_ns // 2]
    return near[-1] if near else None


def _viewed(
    setup: IntegratorSetup, placed: AssignedRootPose, torso: Floats, person: IntegratedPerson, viewer: str, bap: PartialBap
) -> ViewedLimbs:
    angles = angles_of(setup.anatomy, bap.angles, person.pose.angles)
    ray = placed.position - setup.cameras[viewer].centre
    visible = np.array([bap.limbs[limb].visible if limb in bap.limbs else 0.0 for limb in LIMBS])
    return ViewedLimbs(limb_directions(setup.anatomy, angles), visible, torso.T @ (ray / np.linalg.norm(ray)))
