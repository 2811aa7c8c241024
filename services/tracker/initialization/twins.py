"""Twins of a pose: others that two views show nearly the same, with legs or heading exchanged."""

# Paper (added): [Hybrid V] does not exchange legs or headings.

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.body.definition import Bdp
from zenocap.common.body.inverse_kinematics import poses_from_centres
from zenocap.common.body.kinematics import joint_centres
from zenocap.services.tracker import parameters as p
from zenocap.services.tracker.body.body_model import RootedPose
from zenocap.services.tracker.evidence.evidence import Evidence
from zenocap.services.tracker.filter.filter_step import residual_weights
from zenocap.services.tracker.initialization.relocalization import search_postures, searched, turned_start
from zenocap.services.tracker.states import RivalKind, TrackedPerson, TrackerSetup

OPPOSITE = {"R": "L", "L": "R"}
UPPER = ("Hip", "Shoulder", "Elbow", "Wrist")  # joint centres that stay where knees and ankles are exchanged


def exchanged(
    setup: TrackerSetup, person: TrackedPerson, evidence: Evidence, pose: RootedPose, kind: RivalKind, passes: int
) -> RootedPose:
    """The best pose in the scene that is the twin of a pose, itself where it has none.  passes: as SEARCH_PASSES."""
    starts: Sequence[RootedPose]
    if kind == "legs":
        starts = exchanged_legs(setup.anatomy, person.body, pose)
    elif kind == "back":
        back = pose.rotation @ np.diag([-1.0, 1.0, -1.0])
        starts = [one._replace(position=pose.position, rotation=back) for one in (*search_postures(setup.anatomy), pose)]
        starts = [*starts, exchanged_limbs(setup.anatomy, person.body, pose)]
    else:
        turn = _mirror_turn(setup, pose)
        if turn is None:
            return pose
        starts = [turned_start(pose, pose.position, turn)]
    (found,) = searched(person.model, evidence, starts, residual_weights(setup, p.PARTICLE_HOLD), (1, passes))
    return found


def _mirror_turn(setup: TrackerSetup, pose: RootedPose) -> float | None:
    """Turn in radians to the heading mirrored about a viewing direction; None where views show the difference.

    Two level views at a right angle show a trunk with the same widths in both headings.
    """
    towards = [camera.centre - pose.position for camera in setup.cameras.values()]
    azimuths = [float(np.arctan2(x, z)) for x, _, z in towards]
    heading = float(np.arctan2(pose.rotation[0, 2], pose.rotation[2, 2]))
    if len(azimuths) != 2:
        return None
    angles = azimuths[1] - azimuths[0], 2.0 * (azimuths[0] - heading)
    between, turn = ((angle + np.pi) % (2.0 * np.pi) - np.pi for angle in angles)
    for angle, (least, most) in ((between, p.MIRROR_VIEWS_DEG), (turn, p.MIRROR_TURNS_DEG)):
        if not least < np.degrees(abs(angle)) < most:
            return None
    return turn


def exchanged_limbs(anatomy: Anatomy, body: Bdp, pose: RootedPose, kept: tuple[str, ...] = ()) -> RootedPose:
    """The pose whose left joint centres are where the right ones were, as far as the limits of the joints allow.

    kept: joints that stay, without their sides.
    """
    centres = joint_centres(anatomy, body, pose.pose(anatomy))
    names = [one.name for one in anatomy.markers]
    names = [name if name[1:] in kept else OPPOSITE.get(name[0], name[0]) + name[1:] for name in names]
    other = {name: at[None] for name, at in zip(names, centres, strict=True)}
    (found,) = poses_from_centres(anatomy, other, body)
    return RootedPose.of(anatomy, body, found)


def exchanged_legs(anatomy: Anatomy, body: Bdp, pose: RootedPose) -> tuple[RootedPose, RootedPose]:
    """The pose with the other leg ahead, and with knees and ankles in each other's places."""
    right, left, signs = leg_columns(anatomy)
    ahead, crossed = pose.copy(), pose.copy()
    ahead.values[right], ahead.values[left] = signs * pose.values[left], signs * pose.values[right]
    legs = np.concatenate([right, left])
    crossed.values[legs] = exchanged_limbs(anatomy, body, pose, UPPER).values[legs]
    return ahead, crossed


@lru_cache
def leg_columns(anatomy: Anatomy) -> tuple[Ints, Ints, Floats]:
    """Joint coordinates of the right and of the left leg, and the factors between those of mirrored legs."""
    names = coordinates_of(anatomy).names
    own = [name for name in names if name.startswith(("right_hip", "right_knee", "right_ankle"))]
    right, left = (np.array([names.index(name.replace("right", side)) for name in own]) for side in ("right", "left"))
    return right, left, np.array([-1.0 if name.endswith((".2", ".3")) else 1.0 for name in own])
