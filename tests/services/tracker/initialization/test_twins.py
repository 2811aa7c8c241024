"""Twins of a pose: legs, limbs, heading exchanged."""

import numpy as np
import pytest

from tests.services.tracker.initialization.test_heading import BODY, MODEL, SETUP, STANDING, rays, standing, tracking
from tests.support.anatomies import each_anatomy
from tests.support.tracker_ring import ahead, ring, setup
from tests.support.tracker_scenes import NO_RAYS, frames_of, rays_alone
from zenocap.common.body.anatomy import FOURTEEN_PARTS, Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.body.kinematics import joint_centres
from zenocap.services.tracker.body.average_body import average_body
from zenocap.services.tracker.body.body_model import RootedPose, model_of
from zenocap.services.tracker.filter.confidence import LEGS, limb_points
from zenocap.services.tracker.initialization.decisions import faces
from zenocap.services.tracker.initialization.postures import search_postures, turned_start
from zenocap.services.tracker.initialization.twins import exchanged, exchanged_legs, exchanged_limbs, mirrored_about_feet
from zenocap.services.tracker.parameters import SEARCH_PASSES
from zenocap.services.tracker.states import MIRROR_KINDS


def stride(anatomy: Anatomy) -> RootedPose:
    return search_postures(anatomy)[3]._replace(position=np.array([0.1, 0.9, 0.2]))


@each_anatomy
def test_exchanged_legs_have_the_other_one_ahead_and_mirrored_feet_each_others_places(anatomy: Anatomy) -> None:
    body, pose = average_body(anatomy, 1.75), stride(anatomy)
    model, other_ahead = model_of(anatomy, body), exchanged_legs(anatomy, pose)
    np.testing.assert_array_equal(exchanged_legs(anatomy, other_ahead).values, pose.values)
    mirrored, kept = mirrored_about_feet(anatomy, model, pose)
    there, changed, across = (limb_points(anatomy, model, one) for one in (pose, other_ahead, mirrored))
    np.testing.assert_allclose(changed[:, [3, 2]] - pose.position, (there[:, LEGS] - pose.position) * [-1, 1, 1], atol=1e-9)
    np.testing.assert_allclose(across[1, [3, 2]], there[1, LEGS], atol=1e-9)
    line = there[1, 3] - there[1, 2]
    for one in (0, 1):  # of all limbs: as far along the line of the feet, and across it on the other side
        moved = across[one, [1, 0, 3, 2]] - there[one]
        np.testing.assert_allclose(moved @ (line * [1, 0, 1]), 0.0, atol=1e-9)
    assert np.linalg.det(kept.rotation) == pytest.approx(1.0)
    np.testing.assert_array_equal(mirrored_about_feet(anatomy, model, mirrored)[0].values, pose.values)


@each_anatomy
def test_exchanged_limbs_are_where_the_others_were(anatomy: Anatomy) -> None:
    body, pose = average_body(anatomy, 1.75), standing(anatomy)
    pose.values[coordinates_of(anatomy).names.index("right_elbow.x")] += 0.8
    other = exchanged_limbs(anatomy, body, pose)
    assert other.rotation[:, 2] @ pose.rotation[:, 2] < -0.95
    at = {one.name: k for k, one in enumerate(anatomy.markers)}
    here, there = (joint_centres(anatomy, body, one.pose(anatomy)) for one in (pose, other))
    there += here[at["Hip"]] - there[at["Hip"]]
    for name in ("Elbow", "Wrist", "Knee", "Ankle"):
        for one, opposite in ("LR", "RL"):
            np.testing.assert_allclose(there[at[one + name]], here[at[opposite + name]], atol=0.06)


def test_opposite_pose_fills_the_same_space() -> None:
    person = tracking(STANDING).person
    found = exchanged(SETUP, person, rays_alone(rays()), STANDING, "back", SEARCH_PASSES)
    assert not faces(found, STANDING.rotation[:, 2])
    right, left = (FOURTEEN_PARTS.index[f"{side}_lower_arm"] for side in ("right", "left"))
    assert np.linalg.norm(frames_of(MODEL, STANDING)[right, :, 3] - frames_of(MODEL, found)[left, :, 3]) < 0.08
    assert person.body is BODY


@pytest.mark.parametrize(
    ("views", "yaw", "first", "second"),
    [(2, 0.6, -0.6, np.pi - 0.6), (2, -0.9, 0.9, 0.9 - np.pi), (2, 0.1, 0.1, 0.1), (2, 1.5, 1.5, 1.5), (4, 0.6, 0.6, 0.6)],
)
def test_two_views_at_a_right_angle_have_mirrored_headings_and_others_have_none(
    views: int, yaw: float, first: float, second: float
) -> None:
    """The first camera is along +Z."""
    pose = turned_start(stride(FOURTEEN_PARTS), np.array([0.0, 0.9, 0.0]), yaw)
    for kind, mirrored in zip(MIRROR_KINDS, (first, second), strict=True):
        found = exchanged(setup(ring(views)), tracking(pose).person, rays_alone(NO_RAYS), pose, kind, 1)
        np.testing.assert_allclose(found.rotation[:, 2], ahead(mirrored), atol=1e-6)
