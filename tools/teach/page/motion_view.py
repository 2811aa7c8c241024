"""A take as the page shows it: features, speed, and poses in chunks of integers."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.errors import UserError
from zenocap.common.formats.joint_map import JointMap
from zenocap.common.formats.pose_track import PoseTrack
from zenocap.services.animator.body_geometry import placed_capsules
from zenocap.services.animator.page.page_messages import BodyUpdate
from zenocap.services.animator.page.page_updates import body_update
from zenocap.services.recognizer.features import Kind
from zenocap.services.recognizer.training.example_files import Features, features_of, read_track
from zenocap.services.recognizer.training.labelling import Candidate, candidates_of, speeds_of
from zenocap.tools.teach.page.parameters import CHUNK_S, CURVE_POINTS, MAX_POSE_RATE, POSITION_SCALE, QUATERNION_SCALE


@dataclass(frozen=True)
class MotionView:
    """A take.  track: every frame.  source: its path as given."""

    source: Path
    track: PoseTrack

    def features(self, kind: Kind) -> Features:
        """Rows of every frame for a model with this kind of angles."""
        return features_of(self.track, kind)

    @property
    def stride(self) -> int:
        """Frames from one pose that is sent to the next."""
        return max(1, round(self.track.rate / MAX_POSE_RATE))

    @property
    def chunk_poses(self) -> int:
        return max(1, round(CHUNK_S * self.track.rate / self.stride))

    @property
    def chunks(self) -> int:
        return -(-len(self.pose_times_s) // self.chunk_poses)

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

    joints: see `read_track`.
    """
    track = read_track(path, joints)
    known = int(track.known.sum())
    if not known and path.suffix.lower() != ".mcap":
        raise UserError(f"{path}: no frame with a pose: allowed: two or more")
    if not known or not track.rate > 0:
        raise UserError(f"{path}: {known} frames with a pose: allowed: two or more")
    return MotionView(path, track)
