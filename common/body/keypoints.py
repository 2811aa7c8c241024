"""Points of a joint convention on a posed body."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.clinical_angles import segment_axes
from zenocap.common.body.definition import Bdp, Pose, neutral_pose
from zenocap.common.body.joint_conventions import (
    ANKLE_HEIGHT,
    CONVENTIONS,
    WAIST,
    WRIST_SHARE,
    Convention,
    Point,
    points_of,
)
from zenocap.common.body.kinematics import joint_centres, part_frames

SIDES = (("R", "right"), ("L", "left"))


@dataclass(frozen=True)
class Keypoints:
    """Points of a convention on the body of one person.

    offsets: (points, 3) metres, in the axes of their parts.
    """

    anatomy: Anatomy
    bdp: Bdp
    convention: Convention
    points: tuple[Point, ...]
    offsets: Floats

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(point.name for point in self.points)

    def at(self, pose: Pose) -> Floats:
        """Points (points, 3) of a pose in the world, metres."""
        if self.convention == "zenocap" and len(self.points) == len(self.anatomy.markers):
            return joint_centres(self.anatomy, self.bdp, pose)
        bases = _bases(self.anatomy, self.bdp, pose)
        rotations = part_frames(self.anatomy, self.bdp, pose)[:, :, :3]
        found = np.empty((len(self.points), 3))
        for k, point in enumerate(self.points):
            found[k] = np.mean([bases[base] for base in point.bases], axis=0)
            if point.part:
                found[k] += rotations[self.anatomy.index[point.part]] @ self.offsets[k]
        return found


def keypoints(convention: Convention, anatomy: Anatomy, bdp: Bdp, *, spine: bool = False) -> Keypoints:
    """Points of a convention on a body, with offsets of its size.  Raises ValueError for an unknown convention.

    spine: with the joints of the spine, see `points_of`.
    """
    if convention not in CONVENTIONS:
        raise ValueError(f"joints = {convention!r}: allowed: {', '.join(CONVENTIONS)}")
    points = points_of(convention, anatomy, spine=spine)
    lengths = body_lengths(anatomy, bdp)
    offsets = np.zeros((len(points), 3))
    for k, point in enumerate(points):
        if point.part:
            shares = np.array(point.offset_mm) / point.reference_mm
            offsets[k] = lengths[point.scale] * segment_axes(point.part) @ shares
    return Keypoints(anatomy, bdp, convention, points, offsets)


def body_lengths(anatomy: Anatomy, bdp: Bdp) -> dict[str, float]:
    """Lengths that the offsets are shares of, metres; between joint centres, and `foot`, of the part."""
    at = _bases(anatomy, bdp, neutral_pose(anatomy, np.zeros(3)))
    found = {
        "stature": float(at["Head"][1] - at["RAnkle"][1]) / (1.0 - ANKLE_HEIGHT),
        "hip_half": _distance(at, "RHip", "LHip") / 2,
        "shoulder_half": _distance(at, "RShoulder", "LShoulder") / 2,
        "upper_arm": _distance(at, "RShoulder", "RElbow"),
        "thigh": _distance(at, "RHip", "RKnee"),
        "shank": _distance(at, "RKnee", "RAnkle"),
    }
    if "right_foot" in anatomy.parts:
        found["foot"] = float(bdp.sizes[anatomy.index["right_foot"], 0])
    return found


def _bases(anatomy: Anatomy, bdp: Bdp, pose: Pose) -> dict[str, Floats]:
    """Positions (3,) of the bases of points in the world, metres.

    They are the markers of the anatomy, `RWristCentre` and left on the axes of the lower arms, with a spine of two parts
    `Waist`, its joint, and `HeadJoint`, and, with feet, `RSole` and left, on the sole below the ankle.
    """
    names = (marker.name for marker in anatomy.markers)
    found = dict(zip(names, joint_centres(anatomy, bdp, pose), strict=True))
    frames = part_frames(anatomy, bdp, pose)
    if WAIST in anatomy.index:
        found |= {"Waist": frames[anatomy.index[WAIST], :, 3], "HeadJoint": frames[anatomy.index["head"], :, 3]}
    for letter, side in SIDES:
        arm = anatomy.index[f"{side}_lower_arm"]
        found[f"{letter}WristCentre"] = frames[arm, :, 3] + WRIST_SHARE * bdp.sizes[arm, 0] * frames[arm, :, 1]
        if f"{side}_foot" in anatomy.parts:
            foot = anatomy.index[f"{side}_foot"]
            found[f"{letter}Sole"] = frames[foot, :, 3] + (bdp.starts[foot, 2] - bdp.sizes[foot, 2]) * frames[foot, :, 2]
    return found


def _distance(at: Mapping[str, Floats], first: str, second: str) -> float:
    return float(np.linalg.norm(at[first] - at[second]))
