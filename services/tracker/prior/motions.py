"""Motions for training as pose coordinates: files, takes, simulated person."""

from pathlib import Path

import numpy as np

from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.coordinates import coordinates_of, unwrap_rotations
from zenocap.common.body.definition import Pose
from zenocap.common.body.inverse_kinematics import poses_from_centres
from zenocap.common.formats.joint_map import JointMap
from zenocap.common.formats.motion_files import read_poses_for
from zenocap.services.tracker.prior.sequences import TrainingMotion
from zenocap.simulation.body.person import person
from zenocap.simulation.ground_truth import landmarks
from zenocap.simulation.motion.motion_corpus import corpus_motion


def read_motion(
    path: Path, anatomy: Anatomy, frames: range | None = None, joints: JointMap | None = None
) -> TrainingMotion:
    """Motion in a .bvh, .trc, .c3d or a take (.mcap); see `read_poses_for`.  Raises UserError."""
    found = read_poses_for(path, anatomy, frames, joints)
    table = coordinates_of(anatomy)
    coordinates = np.full((len(found.poses), table.dimension), np.nan)
    rows_with_pose = [row for row, pose in enumerate(found.poses) if pose is not None]
    poses = np.array([table.of_pose(pose) for pose in found.poses if pose is not None])
    coordinates[rows_with_pose] = unwrap_rotations(anatomy, poses)
    coordinates[~found.known] = np.nan
    return TrainingMotion(found.name, found.rate, coordinates)


def motion_of(name: str, rate: float, anatomy: Anatomy, poses: list[Pose]) -> TrainingMotion:
    """Poses of consecutive frames as a motion."""
    table = coordinates_of(anatomy)
    return TrainingMotion(name, rate, unwrap_rotations(anatomy, np.array([table.of_pose(pose) for pose in poses])))


def actor_motion(kind: str, person_seed: int, seed: int, anatomy: Anatomy, rate: float = 60.0) -> TrainingMotion:
    """About half a minute of the simulated person: `walking`, `running`, `boxing` or `general`.

    person_seed: random seed of the body.  seed: of the motion.  Both 0 or more.  Raises ValueError for another kind.
    """
    subject = person(person_seed)
    performed = corpus_motion(subject, kind, seed)
    frames = [landmarks(subject, performed.pose_at(k / rate)) for k in range(int(performed.duration_s * rate))]
    centres = {name: np.array([points[name] for points in frames]) for name in frames[0]}
    return motion_of(f"actor-{kind}-{person_seed}-{seed}", rate, anatomy, poses_from_centres(anatomy, centres))
