"""Error of an estimate against ground truth, frame by frame."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.people.films import Film
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS, Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import joint_centres, part_frames
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


LIMBS = (("RElbow", "RWrist"), ("LElbow", "LWrist"), ("RKnee", "RAnkle"), ("LKnee", "LAnkle"))
WRONG_MM, REVERSED_DEG = 150.0, 90.0


def limbs_right(error: FrameError) -> list[bool]:
    """Whether the joints of each of LIMBS are within 150 mm of the true ones."""
    return [all(error.joints[JOINTS.index(name)] < WRONG_MM for name in limb) for limb in LIMBS]


def film_errors(film: Film, estimates: Mapping[int, Estimate], first: int | None = None) -> list[FrameError]:
    """Errors of the frames of a film from `first` on, by default those of the motion."""
    start = film.motion_from if first is None else first
    truths = film.truths[start:]
    return [frame_error(estimates.get(start + k), true) for k, true in enumerate(truths) if true is not None]


def summary(errors: Sequence[FrameError]) -> dict[str, float]:
    """Means and median over the frames that have an estimate: degrees, mm, %."""
    segments = np.concatenate([error.segments for error in errors])
    joints = np.concatenate([error.joints for error in errors])
    yaw = np.array([error.yaw for error in errors])
    lost = 100.0 * float(np.mean([error.lost for error in errors]))
    known = np.isfinite(segments)
    if not known.any():
        return {"lost": lost}
    return {
        "segments": float(segments[known].mean()),
        "median": float(np.median(segments[known])),
        "joints": float(joints[np.isfinite(joints)].mean()),
        "yaw": float(yaw[np.isfinite(yaw)].mean()),
        "lost": lost,
    }
