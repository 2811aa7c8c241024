"""Motion to learn from, as coordinates of poses: from files of motion capture, from takes, from the synthetic actor."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from common.actor.person import person
from common.actor.repertoire import performance
from common.actor.truth import landmarks
from common.body.anatomy import Anatomy, Floats
from common.body.coordinates import coordinates_of, unwound
from common.body.definition import Pose
from common.body.from_centres import poses_from_centres
from common.formats.motions import read_poses_for


@dataclass(frozen=True)
class Motion:
    """coordinates: (n, d) radians in the order of `coordinates_of(anatomy).names`, one row a frame, without jumps; NaN
    where there is no pose.  rate: frames per second."""

    name: str
    rate: float
    coordinates: Floats


def read_motion(path: Path, anatomy: Anatomy, frames: range | None = None) -> Motion:
    """The motion in a .bvh, a .trc or a take (.mcap); see `read_poses_for`.  Raises FormatError and TakeError."""
    found = read_poses_for(path, anatomy, frames)
    table = coordinates_of(anatomy)
    coordinates = np.full((len(found.poses), table.dimension), np.nan)
    there = [row for row, pose in enumerate(found.poses) if pose is not None]
    poses = np.array([table.of_pose(pose) for pose in found.poses if pose is not None])
    coordinates[there] = unwound(anatomy, poses)
    coordinates[~found.known] = np.nan
    return Motion(found.name, found.rate, coordinates)


def motion_of(name: str, rate: float, anatomy: Anatomy, poses: list[Pose]) -> Motion:
    """The poses of consecutive frames as a motion."""
    table = coordinates_of(anatomy)
    return Motion(name, rate, unwound(anatomy, np.array([table.of_pose(pose) for pose in poses])))


def actor_motion(kind: str, person_seed: int, seed: int, anatomy: Anatomy, rate: float = 60.0) -> Motion:
    """About half a minute of the synthetic actor: `walking`, `running`, `boxing` or `general`.

    person_seed: who.  seed: which performance.  Both 0 or more.  Raises ValueError for another kind.
    """
    somebody = person(person_seed)
    acted = performance(somebody, kind, seed)
    frames = [landmarks(somebody, acted.pose_at(k / rate)) for k in range(int(acted.duration_s * rate))]
    centres = {name: np.array([points[name] for points in frames]) for name in frames[0]}
    return motion_of(f"actor-{kind}-{person_seed}-{seed}", rate, anatomy, poses_from_centres(anatomy, centres))
