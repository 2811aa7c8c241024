"""A take as the page shows it: features, speed, and poses in chunks of integers."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.definition import Pose
from zenocap.common.body.proportions import average_lengths, body_from_lengths
from zenocap.common.errors import UserError
from zenocap.common.formats.joint_map import JointMap
from zenocap.common.formats.motion_files import read_poses_for
from zenocap.common.formats.pose_track import PoseTrack, every_frame
from zenocap.common.formats.take_poses import read_poses
from zenocap.services.animator.body_geometry import placed_capsules
from zenocap.services.animator.page.page_messages import BodyUpdate
from zenocap.services.animator.page.page_updates import body_update
from zenocap.services.recognizer.features import Kind
from zenocap.services.recognizer.motion_rows import rows_of
from zenocap.services.recognizer.training.example_files import Features
from zenocap.services.recognizer.training.labelling import Candidate, candidates_of, speeds_of
from zenocap.tools.teach.page.parameters import (
    CHUNK_S,
    CURVE_POINTS,
    MAX_POSE_RATE,
    POSITION_SCALE,
    QUATERNION_SCALE,
)

AVERAGE_HEIGHT_M = 1.72  # of the figure for motion capture, which has no measured body


@dataclass(frozen=True)
class MotionView:
    """A take.  track: every frame.  source: its path as given."""

    source: Path
    track: PoseTrack

    def features(self, kind: Kind) -> Features:
        """Rows of every frame for a model with this kind of angles."""
        track = self.track
        return Features(track.rate, track.times_s, rows_of(track.anatomy, track.positions, track.angles, kind))

    @property
    def stride(self) -> int:
        """Frames from one pose that is sent to the next."""
        return max(1, round(self.track.rate / MAX_POSE_RATE))

    @property
    def chunk_poses(self) -> int:
        """Poses in a chunk."""
        return max(1, round(CHUNK_S * self.track.rate / self.stride))

    @property
    def pose_times_s(self) -> Floats:
        """Times of the poses that are sent."""
        return self.track.times_s[:: self.stride]

    def chunk(self, number: int) -> bytes:
        """Poses of a chunk: for each pose and part 16-bit integers, little-endian; empty beyond the end.

        x, y, z of the near end in 1 / POSITION_SCALE m, then quaternion x, y, z, w in 1 / QUATERNION_SCALE; all zero
        while the person is lost.
        """
        first = number * self.chunk_poses * self.stride
        rows = range(first, min(first + self.chunk_poses * self.stride, len(self.track.times_s)), self.stride)
        values = np.zeros((len(rows), len(self.track.anatomy.parts), 7))
        for k, row in enumerate(rows):
            if self.track.known[row]:
                placed = placed_capsules(self.track.anatomy, self.track.bdp, self.track.pose(row))
                values[k, :, :3] = placed.positions * POSITION_SCALE
                values[k, :, 3:] = placed.quaternions * QUATERNION_SCALE
        return np.clip(np.round(values), -32768, 32767).astype("<i2").tobytes()

    def curve(self) -> tuple[list[float], float]:
        """Speed of the movement over the take, rad/s, evenly spaced over its time; -1 without a pose.  The largest."""
        features = self.features("directions")
        speeds = speeds_of(features.features, features.rate)
        known = np.where(np.isfinite(speeds), speeds, -1.0)
        count = min(CURVE_POINTS, len(known))
        edges = np.linspace(0, len(known), count + 1).astype(np.int64)
        points = np.maximum.reduceat(known, edges[:-1])
        return np.round(points, 2).tolist(), float(max(points.max(), 0.0))

    def proposals(self) -> list[Candidate]:
        """Movements between two pauses."""
        features = self.features("directions")
        return candidates_of(features.times_s, features.features, features.rate)

    def body(self) -> BodyUpdate:
        """Shape of the body."""
        return body_update("take", self.track.anatomy, self.track.bdp)


def open_motion(path: Path, joints: JointMap | None = None) -> MotionView:
    """Read a take (.mcap) or motion capture (.bvh, .trc, .c3d).  Raises UserError, also for one without poses.

    joints: names of joints and markers of motion capture that are not recognized.
    """
    if path.suffix.lower() == ".mcap":
        track = every_frame(read_poses(path).track(), 0)
        if not track.rate > 0 or not track.known.any():
            raise UserError(f"{path}: {int(track.known.sum())} frames with a pose: allowed: two or more")
        return MotionView(path, track)
    motion = read_poses_for(path, TEN_PARTS, joints=joints)
    poses: list[Pose | None] = [
        pose if known else None for pose, known in zip(motion.poses, motion.known.tolist(), strict=True)
    ]
    if not any(poses):
        raise UserError(f"{path}: no frame with a pose: allowed: two or more")
    count = len(poses)
    positions, angles = np.full((count, 3), np.nan), np.full((count, len(TEN_PARTS.angles)), np.nan)
    for row, pose in enumerate(poses):
        if pose is not None:
            positions[row], angles[row] = pose.position, pose.angles
    body = body_from_lengths(TEN_PARTS, average_lengths(AVERAGE_HEIGHT_M))
    lost = tuple("" if pose is not None else "person" for pose in poses)
    track = PoseTrack(
        anatomy=TEN_PARTS, bdp=body, frames=np.arange(count), times_s=motion.times_s, positions=positions, angles=angles,
        scores={}, views={}, lost=lost, rate=motion.rate, limbs={},
    )  # fmt: skip
    return MotionView(path, track)
