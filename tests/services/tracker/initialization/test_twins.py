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
from zenocap.services.tracker.initialization.relocalization import search_postures, turned_start
from zenocap.services.tracker.initialization.twins import exchanged, exchanged_legs, exchanged_limbs
from zenocap.services.tracker.parameters import SEARCH_PASSES


def stride(anatomy: Anatomy) -> RootedPose:
    return search_postures(anatomy)[3]._replace(position=np.array([0.1, 0.9, 0.2]))


@each_anatomy
def test_exchanged_legs_have_the_other_one_ahead_or_the_places_of_each_other(anatomy: Anatomy) -> None:
    body, pose = average_body(anatomy, 1.75), stride(anatomy)
    other_ahead, crossed = exchanged_legs(anatomy, body, pose)
    np.testing.assert_array_equal(exchanged_legs(anatomy, body, other_ahead)[0].values, pose.values)
    model = model_of(anatomy, body)
    there, mirrored, across = (limb_points(anatomy, model, one)[:, LEGS] for one in (pose, other_ahead, crossed))
    np.testing.assert_allclose(mirrored[:, ::-1] - pose.position, (there - pose.position) * [-1, 1, 1], atol=1e-9)
    np.testing.assert_allclose(across[:, ::-1], there, atol=0.08)


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
    ("views", "yaw", "mirrored"), [(2, 0.6, -0.6), (2, -0.9, 0.9), (2, 0.1, 0.1), (2, 1.5, 1.5), (4, 0.6, 0.6)]
)
def test_two_views_at_a_right_angle_have_a_mirrored_heading_and_others_have_none(
    views: int, yaw: float, mirrored: float
) -> None:
    """The first camera is along +Z."""
    pose = turned_start(stride(FOURTEEN_PARTS), np.array([0.0, 0.9, 0.0]), yaw)
    found = exchanged(setup(ring(views)), tracking(pose).person, rays_alone(NO_RAYS), pose, "mirror", 1)
    np.testing.assert_allclose(found.rotation[:, 2], ahead(mirrored), atol=1e-6)
