"""Fit of the true pose against that of a found one with a wrong limb, in the case of limits."""

from collections.abc import Mapping, Sequence

import numpy as np
import pytest

from benchmarks.cases.starts import true_pose_fits_better
from benchmarks.people.errors import estimate_of
from benchmarks.people.films import Film
from benchmarks.people.session import Track
from tests.support.built_messages import built, silhouette
from tests.support.simulated_cameras import paper_cameras
from zenocap.common import messages as m
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.body.inverse_kinematics import poses_from_centres
from zenocap.common.conversion import angles_by_name, body_of
from zenocap.services.tracker.body.average_body import body_of_height
from zenocap.simulation.body.person import person
from zenocap.simulation.body.pose import neutral
from zenocap.simulation.ground_truth import Truth, truth
from zenocap.simulation.motion.timeline import t_pose
from zenocap.simulation.rendering.camera import SimulatedCamera

SUBJECT = person(3)
POSES = {"stretched": t_pose(SUBJECT), "hanging": neutral(SUBJECT)}
TRUTHS: Mapping[str, Truth] = {name: truth(SUBJECT, pose) for name, pose in POSES.items()}
CAMERAS = {camera.name: camera for camera in paper_cameras((160, 120))}


def film(names: Sequence[str], motion_from: int = 0) -> Film:
    return Film(CAMERAS, {}, tuple(TRUTHS[name] for name in names), 0, motion_from)


def track(seen: Sequence[str], found: Sequence[str]) -> Track:
    """Silhouettes of the one poses, and the other poses as those that were found in them, of a body of the true height."""
    body = body_of_height(SUBJECT.height)
    result = Track([m.TrackerBdp(frame=0, captured_ns=0, body=body_of(FOURTEEN_PARTS, body))])
    for k, (own, stated) in enumerate(zip(seen, found, strict=True)):
        for name, camera in CAMERAS.items():
            mask = np.asarray(SimulatedCamera(camera, SUBJECT, 0).silhouette(POSES[own]) != 0, dtype=np.uint8)
            result.messages.append(silhouette(name, k, k, mask))
        joints = {name: at[None] for name, at in TRUTHS[stated].joints.items()}
        (pose,) = poses_from_centres(FOURTEEN_PARTS, joints, body)
        x, y, z = pose.position.tolist()
        angles = angles_by_name(FOURTEEN_PARTS, pose.angles)
        result.messages.append(built(m.TrackerPose, frame=k, captured_ns=k, position=(x, y, z), angles=angles))
        result.estimates[k] = estimate_of(FOURTEEN_PARTS, body, pose)
    return result


@pytest.mark.slow
def test_the_true_pose_fits_better_where_the_silhouettes_show_it_and_not_where_they_show_the_found_one() -> None:
    true, wrong = "stretched", "hanging"
    assert true_pose_fits_better(film([true] * 2), track([true, wrong], [wrong, wrong])) == [True, False]


def test_frames_with_right_limbs_without_a_pose_or_before_the_motion_do_not_count() -> None:
    true, wrong = "stretched", "hanging"
    assert true_pose_fits_better(film([true]), track([true], [true])) == []
    assert true_pose_fits_better(film([true], motion_from=1), track([true], [wrong])) == []
    lost = track([true], [wrong])
    lost.estimates.clear()
    assert true_pose_fits_better(film([true]), lost) == []
