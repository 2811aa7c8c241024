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
from zenocap.services.tracker.body.body_model import BodyModel, RootedPose
from zenocap.services.tracker.evidence.evidence import Evidence
from zenocap.services.tracker.filter.confidence import LEGS, limb_points
from zenocap.services.tracker.filter.filter_step import residual_weights
from zenocap.services.tracker.initialization.postures import search_postures, turned_start
from zenocap.services.tracker.initialization.relocalization import searched, turn_between
from zenocap.services.tracker.states import MIRROR_KINDS, RivalKind, TrackedPerson, TrackerSetup

OPPOSITE = {"R": "L", "L": "R"}


def exchanged(
    setup: TrackerSetup, person: TrackedPerson, evidence: Evidence, pose: RootedPose, kind: RivalKind, passes: int
) -> RootedPose:
    """The best pose in the scene that is the twin of a pose, itself where it has none.  passes: as SEARCH_PASSES."""
    starts: Sequence[RootedPose]
    if kind == "legs":
        starts = [exchanged_legs(setup.anatomy, pose)]
    elif kind == "feet":
        starts = mirrored_about_feet(setup.anatomy, person.model, pose)
    elif kind == "back":
        back = pose.rotation @ np.diag([-1.0, 1.0, -1.0])
        starts = [one._replace(position=pose.position, rotation=back) for one in (*search_postures(setup.anatomy), pose)]
        starts = [*starts, exchanged_limbs(setup.anatomy, person.body, pose)]
    else:
        turn = mirror_turn(setup, pose, MIRROR_KINDS.index(kind))
        if turn is None or not p.MIRROR_TURNS_DEG[0] < np.degrees(abs(turn)) < p.MIRROR_TURNS_DEG[1]:
            return pose
        starts = [turned_start(pose, pose.position, turn)]
    (found,) = searched(person.model, evidence, starts, residual_weights(setup, p.PARTICLE_HOLD), (1, passes))
    return found


def mirror_turn(setup: TrackerSetup, pose: RootedPose, view: int) -> float | None:
    """Turn in radians to the heading mirrored about the direction of a view; None where views show the difference.

    Two level views at a right angle show a trunk with the same widths in both headings, and in the opposite ones.
    """
    towards = [camera.centre - pose.position for camera in setup.cameras.values()]
    azimuths = [float(np.arctan2(x, z)) for x, _, z in towards]
    heading = float(np.arctan2(pose.rotation[0, 2], pose.rotation[2, 2]))
    if len(azimuths) != 2:
        return None
    angles = azimuths[1] - azimuths[0], 2.0 * (azimuths[view] - heading)
    between, turn = ((angle + np.pi) % (2.0 * np.pi) - np.pi for angle in angles)
    return turn if p.MIRROR_VIEWS_DEG[0] < np.degrees(abs(between)) < p.MIRROR_VIEWS_DEG[1] else None


def exchanged_limbs(anatomy: Anatomy, body: Bdp, pose: RootedPose) -> RootedPose:
    """The pose whose left joint centres are where the right ones were, as far as the limits of the joints allow."""
    centres = joint_centres(anatomy, body, pose.pose(anatomy))
    names = [OPPOSITE.get(one.name[0], one.name[0]) + one.name[1:] for one in anatomy.markers]
    other = {name: at[None] for name, at in zip(names, centres, strict=True)}
    (found,) = poses_from_centres(anatomy, other, body)
    return RootedPose.of(anatomy, body, found)


def exchanged_legs(anatomy: Anatomy, pose: RootedPose) -> RootedPose:
    """The pose with the other leg ahead."""
    found, legs = pose.copy(), leg_columns(anatomy)
    found.values[legs] = mirrored_values(anatomy, pose.values)[legs]
    return found


def mirrored_about_feet(anatomy: Anatomy, model: BodyModel, pose: RootedPose) -> list[RootedPose]:
    """The pose mirrored about the vertical plane through both ankles: the trunk turned, the feet in each other's places.

    Then the same with the arms as they are.  The pose itself where one ankle is over the other, or beside it, so that the
    trunk would be turned round.
    """
    right, left = limb_points(anatomy, model, pose)[1, LEGS]
    across = np.cross(left - right, [0.0, 1.0, 0.0])
    if not np.linalg.norm(across) > p.RIVAL_APART_M:
        return [pose]
    across /= np.linalg.norm(across)
    mirror = np.eye(3) - 2.0 * np.outer(across, across)
    rotation = np.ascontiguousarray(mirror @ pose.rotation @ np.diag([-1.0, 1.0, 1.0]))
    mirrored = RootedPose(right + mirror @ (pose.position - right), rotation, mirrored_values(anatomy, pose.values))
    arms = [k for k, name in enumerate(coordinates_of(anatomy).names) if "shoulder" in name or "elbow" in name]
    if turn_between(pose, mirrored) > np.radians(p.MIRROR_TURNS_DEG[1]):
        return [pose]
    kept = mirrored.copy()
    kept.values[arms] = pose.values[arms]
    return [mirrored, kept]


def mirrored_values(anatomy: Anatomy, values: Floats) -> Floats:
    """Joint coordinates of the mirrored body."""
    order, signs = _mirrored_columns(anatomy)
    found: Floats = signs * values[order]
    return found


@lru_cache
def leg_columns(anatomy: Anatomy) -> Ints:
    """Joint coordinates of both legs."""
    names = coordinates_of(anatomy).names
    return np.array([k for k, name in enumerate(names) if any(one in name for one in ("hip", "knee", "ankle"))])


@lru_cache
def _mirrored_columns(anatomy: Anatomy) -> tuple[Ints, Floats]:
    """Of each joint coordinate that of the other side, and the factor between both."""
    names = coordinates_of(anatomy).names
    sides = {"right": "left", "left": "right"}
    order = [names.index("_".join(sides.get(one, one) for one in name.split("_"))) for name in names]
    return np.array(order), np.array([-1.0 if name.endswith((".2", ".3")) else 1.0 for name in names])
