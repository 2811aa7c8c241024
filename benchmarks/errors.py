"""Error of an estimate against ground truth, frame by frame."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS, Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import joint_centres, part_frames
from zenocap.common.conversion import angles_of
from zenocap.common.messages import UniversalBap
from zenocap.simulation.ground_truth import SEGMENTS, SIDE_NAMES, Truth

JOINTS = tuple(marker.name for marker in TEN_PARTS.markers)
LIMB_SEGMENTS = tuple(f"{side}_{segment}" for side in SIDE_NAMES for segment in SEGMENTS)
LOST_MM = 250.0  # as in score_trc.py


@dataclass(frozen=True)
class Estimate:
    """joints: (15, 3) metres.  directions: (8, 3) of the limb segments in the world.  yaw: radians."""

    joints: Floats
    directions: Floats
    yaw: float


@dataclass(frozen=True)
class FrameError:
    """segments: (8,) degrees.  joints: (15,) mm.  yaw: degrees.  Infinite where there is no estimate."""

    segments: Floats
    joints: Floats
    yaw: float

    @property
    def lost(self) -> bool:
        """No universal BAP for this frame, or its joints are more than 250 mm off in the mean."""
        return bool(self.joints.mean() > LOST_MM)


def estimate(bdp: Bdp, bap: UniversalBap) -> Estimate:
    pose = Pose(np.array(bap.position), angles_of(TEN_PARTS, bap.angles, TEN_PARTS.neutral))
    return estimate_of(TEN_PARTS, bdp, pose)


def estimate_of(anatomy: Anatomy, bdp: Bdp, pose: Pose) -> Estimate:
    """Estimate of a pose of the ten-part or the fourteen-part anatomy; the yaw is that of the torso or the chest."""
    frames = part_frames(anatomy, bdp, pose)
    torso = frames[anatomy.index["torso" if "torso" in anatomy.index else "chest"]]
    return Estimate(
        joint_centres(anatomy, bdp, pose),
        np.stack([frames[anatomy.index[segment], :, 1] for segment in LIMB_SEGMENTS]),
        float(np.arctan2(torso[0, 2], torso[2, 2])),
    )


def frame_error(found: Estimate | None, true: Truth) -> FrameError:
    if found is None:
        return FrameError(np.full(len(LIMB_SEGMENTS), np.inf), np.full(len(JOINTS), np.inf), float("inf"))
    cosines = [found.directions[k] @ true.directions[segment] for k, segment in enumerate(LIMB_SEGMENTS)]
    joints = np.stack([true.joints[name] for name in JOINTS])
    turn = (found.yaw - true.yaw + np.pi) % (2 * np.pi) - np.pi
    return FrameError(
        np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0))),
        1000.0 * np.linalg.norm(found.joints - joints, axis=1),
        abs(float(np.degrees(turn))),
    )


SUMMARY = ("frames", "segment deg", "median", "joint mm", "yaw deg", "lost %", "joints lost %")


def summary(errors: Sequence[FrameError]) -> tuple[int, float, float, float, float, float, float]:
    """The columns of SUMMARY; means and median are over the frames that have an estimate."""
    segments = np.concatenate([error.segments for error in errors])
    joints = np.concatenate([error.joints for error in errors])
    yaw = np.array([error.yaw for error in errors])
    known = np.isfinite(segments)
    if not known.any():
        return len(errors), np.nan, np.nan, np.nan, np.nan, 100.0, 100.0
    return (
        len(errors),
        float(segments[known].mean()),
        float(np.median(segments[known])),
        float(joints[np.isfinite(joints)].mean()),
        float(yaw[np.isfinite(yaw)].mean()),
        100.0 * float(np.mean([error.lost for error in errors])),
        100.0 * float(np.mean(joints > LOST_MM)),
    )
