"""Universal BAP: both viewers' limbs on the torso that the assignment placed.  [Two-view 4.4]"""

from dataclasses import replace

import numpy as np

from common.body.anatomy import Floats
from common.body.definition import Pose
from common.body.limbs import LIMBS, legs_exchanged, limb_angles, limb_directions, resting_arm
from common.body.torso import torso_rotation
from common.conversion import angles_by_name, angles_of
from common.messages import Message, PartialBap, UniversalBap
from common.pairing import Instant
from services.integrator.integration import ViewedLimbs, exchange_evidence, integrate_limbs
from services.integrator.measuring import point
from services.integrator.states import Person, Placed, Setup, State


def pose_person(setup: Setup, state: State, instant: Instant[PartialBap]) -> tuple[State, list[Message]]:
    """The universal BAP of one instant.  A missing viewer's part is what the other one saw; it is named as stale."""
    person = state.person
    placed = _placed(setup, person, instant.captured_ns) if person else None
    if person is None or placed is None:
        return state, []
    torso = torso_rotation(placed.yaw, placed.lean, placed.roll)
    views = [_viewed(setup, placed, torso, person, viewer, bap) for viewer, bap in instant.items.items()]
    resting = resting_arm(torso, placed.yaw)
    directions = integrate_limbs(views, resting, placed.squatting)
    gains = [bap.exchange for bap in instant.items.values() if bap.view == "facade"]
    exchange, mistaken = exchange_evidence(person.exchange, gains[0]) if gains else (person.exchange, False)
    if mistaken:
        directions = legs_exchanged(directions)
    angles = person.pose.angles.copy()
    index = setup.anatomy.index
    angles[[index["navel.y"], index["navel.x"], index["navel.z"]]] = placed.yaw, placed.lean, placed.roll
    angles = limb_angles(setup.anatomy, directions, angles)
    pose = Pose(placed.position, angles)
    state = replace(state, person=replace(person, pose=pose, exchange=exchange))
    stale = [viewer for viewer in setup.cameras if viewer not in instant.items]
    first = next(iter(instant.items.values()))
    return state, [
        UniversalBap(
            frame=first.frame, captured_ns=instant.captured_ns, position=point(pose.position),
            angles=angles_by_name(setup.anatomy, angles),
            scores={viewer: bap.score for viewer, bap in instant.items.items()},
            views=dict(placed.views), stale=stale, lost=[],
        )
    ]  # fmt: skip


def _placed(setup: Setup, person: Person, captured_ns: int) -> Placed | None:
    """The assignment that these partial BAPs answer."""
    near = [p for p in person.placed if abs(p.captured_ns - captured_ns) <= setup.frame_ns // 2]
    return near[-1] if near else None


def _viewed(setup: Setup, placed: Placed, torso: Floats, person: Person, viewer: str, bap: PartialBap) -> ViewedLimbs:
    angles = angles_of(setup.anatomy, bap.angles, person.pose.angles)
    ray = placed.position - setup.cameras[viewer].centre
    visible = np.array([bap.limbs[limb].visible if limb in bap.limbs else 0.0 for limb in LIMBS])
    return ViewedLimbs(limb_directions(setup.anatomy, angles), visible, torso.T @ (ray / np.linalg.norm(ray)))
