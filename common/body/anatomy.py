"""Anatomies: tables of body parts, joints, rotation orders, limits and markers.  [Two-view 2.1]

The number of parts and joints is defined here only; a richer body is another `Anatomy`.

Frames: a part's frame has its origin at its proximal joint, +Y along the part, X to the person's left and Z to the front
while the torso is unrotated.  A limb therefore hangs straight down at a rotation of 180° about Z, as in the paper.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import radians

import numpy as np

from zenocap.common.arrays import Floats, Ints

SPHERICAL_AXES = "zxy"  # M_N^S = T Rz Rx Ry  [Two-view 2.2 (2)]
NAVEL_AXES = "yxz"  # M_W^N = Ry Rx, and the spherical joint's third angle last  [Two-view 2.2 (1)]
FLEXION_AXES = "x"  # M_S^F = T Rx  [Two-view 2.2 (3)]


@dataclass(frozen=True)
class Joint:
    """A joint on `parent` (a part, "" for the world) that rotates `part` about `axes`, first axis outermost.

    Without axes the part is fixed to its parent, so that one moving body may have several surfaces.
    limits: per axis, (lowest, highest) in radians.
    """

    name: str
    parent: str
    part: str
    axes: str
    limits: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Marker:
    """A joint centre for export: the mean of the named joints, or the point on the part's axis at `along` of its height."""

    name: str
    part: str = ""
    along: float = 0.0
    joints: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Anatomy:
    """Joints, parents first; joint k moves part k.  Compared by identity."""

    name: str
    joints: tuple[Joint, ...]
    markers: tuple[Marker, ...]

    @cached_property
    def parts(self) -> tuple[str, ...]:
        """Names of all parts, in the order of the joints."""
        return tuple(j.part for j in self.joints)

    @cached_property
    def angles(self) -> tuple[str, ...]:
        """Names of all joint angles, `joint.axis`, in the order of a pose's angle array."""
        return tuple(f"{j.name}.{axis}" for j in self.joints for axis in j.axes)

    @cached_property
    def index(self) -> Mapping[str, int]:
        """Index of every angle name, part name and joint name in its own table."""
        table = {name: k for k, name in enumerate(self.angles)}
        table |= {j.part: k for k, j in enumerate(self.joints)}
        return table | {j.name: k for k, j in enumerate(self.joints)}

    @cached_property
    def limits(self) -> Floats:
        """(angles, 2) lowest and highest value of every joint angle in radians."""
        return np.array([limit for j in self.joints for limit in j.limits])

    @cached_property
    def tree(self) -> Ints:
        """(joints, 5) for compiled code: parent part or -1, first angle, then three axes: 0 x, 1 y, 2 z, -1 none."""
        rows, first = [], 0
        for j in self.joints:
            axes = ["xyz".index(a) for a in j.axes] + [-1] * (3 - len(j.axes))
            rows.append([self.parts.index(j.parent) if j.parent else -1, first, *axes])
            first += len(j.axes)
        return np.array(rows, dtype=np.int64)

    @cached_property
    def neutral(self) -> Floats:
        """(angles,) of the upright pose with arms and legs hanging straight down, radians."""
        angles = np.zeros(len(self.angles))
        for j in self.joints:
            if "shoulder" in j.name or "hip" in j.name:
                angles[self.index[f"{j.name}.z"]] = np.pi
            elif "ankle" in j.name:
                angles[self.index[f"{j.name}.x"]] = np.pi / 2
        return angles


def without_side(name: str) -> str:
    """Name of a joint or part without `right_` or `left_`."""
    return name.removeprefix("right_").removeprefix("left_")


def _joint(name: str, parent: str, part: str, axes: str, *limits_deg: tuple[float, float]) -> Joint:
    return Joint(name, parent, part, axes, tuple((radians(lo), radians(hi)) for lo, hi in limits_deg))


# Paper (open): 3.3 and 3.4 give some ranges of motion, which are used; the others are wide and chosen by hand.
TEN_PARTS = Anatomy(
    name="ten-parts",
    joints=(
        _joint("navel", "", "torso", NAVEL_AXES, (-360, 360), (-45, 110), (-45, 45)),
        _joint("neck", "torso", "head", SPHERICAL_AXES, (-45, 45), (-60, 60), (-80, 80)),
        _joint("right_shoulder", "torso", "right_upper_arm", SPHERICAL_AXES, (0, 180), (-180, 180), (-180, 180)),
        _joint("left_shoulder", "torso", "left_upper_arm", SPHERICAL_AXES, (180, 360), (-180, 180), (-180, 180)),
        _joint("right_elbow", "right_upper_arm", "right_lower_arm", FLEXION_AXES, (-140, 140)),
        _joint("left_elbow", "left_upper_arm", "left_lower_arm", FLEXION_AXES, (-140, 140)),
        _joint("right_hip", "torso", "right_upper_leg", SPHERICAL_AXES, (110, 205), (-60, 135), (-45, 45)),
        _joint("left_hip", "torso", "left_upper_leg", SPHERICAL_AXES, (155, 250), (-60, 135), (-45, 45)),
        _joint("right_knee", "right_upper_leg", "right_lower_leg", FLEXION_AXES, (-150, 0)),
        _joint("left_knee", "left_upper_leg", "left_lower_leg", FLEXION_AXES, (-150, 0)),
    ),
    # Ankle and wrist: the lower leg ends at the sole and the lower arm at the fingertips, as in silhouettes.
    # Segment lengths in body heights from Drillis and Contini (1966) as in Winter, Biomechanics, 4th ed., fig. 4.1.
    markers=(
        Marker("Hip", joints=("navel",)),
        Marker("RHip", joints=("right_hip",)),
        Marker("RKnee", joints=("right_knee",)),
        Marker("RAnkle", "right_lower_leg", (0.285 - 0.039) / 0.285),
        Marker("LHip", joints=("left_hip",)),
        Marker("LKnee", joints=("left_knee",)),
        Marker("LAnkle", "left_lower_leg", (0.285 - 0.039) / 0.285),
        Marker("Neck", joints=("right_shoulder", "left_shoulder")),
        Marker("Head", "head", 1.0),
        Marker("RShoulder", joints=("right_shoulder",)),
        Marker("RElbow", joints=("right_elbow",)),
        Marker("RWrist", "right_lower_arm", 0.146 / (0.146 + 0.108)),
        Marker("LShoulder", joints=("left_shoulder",)),
        Marker("LElbow", joints=("left_elbow",)),
        Marker("LWrist", "left_lower_arm", 0.146 / (0.146 + 0.108)),
    ),
)

# Paper (replaced): [Hybrid II] has ten parts and 25 DoF; here a spine in two parts, a neck and feet, with 30.
FOURTEEN_PARTS = Anatomy(
    name="fourteen-parts",
    joints=(
        # Paper (replaced): [Hybrid II] has the origin in the middle of the torso; here at the hips.
        _joint("navel", "", "pelvis", NAVEL_AXES, (-360, 360), (-60, 110), (-60, 60)),
        _joint("waist", "pelvis", "chest", SPHERICAL_AXES, (-45, 45), (-40, 75), (-55, 55)),
        _joint("neck_base", "chest", "neck_column", ""),
        _joint("neck", "neck_column", "head", SPHERICAL_AXES, (-45, 45), (-60, 60), (-80, 80)),
        _joint("right_shoulder", "chest", "right_upper_arm", SPHERICAL_AXES, (0, 180), (-180, 180), (-180, 180)),
        _joint("left_shoulder", "chest", "left_upper_arm", SPHERICAL_AXES, (180, 360), (-180, 180), (-180, 180)),
        # Paper (replaced): [Hybrid II] names 135 degrees for the elbow; here 150, by anthropometry.
        _joint("right_elbow", "right_upper_arm", "right_lower_arm", FLEXION_AXES, (0, 150)),
        _joint("left_elbow", "left_upper_arm", "left_lower_arm", FLEXION_AXES, (0, 150)),
        _joint("right_hip", "pelvis", "right_upper_leg", SPHERICAL_AXES, (110, 205), (-60, 135), (-45, 45)),
        _joint("left_hip", "pelvis", "left_upper_leg", SPHERICAL_AXES, (155, 250), (-60, 135), (-45, 45)),
        _joint("right_knee", "right_upper_leg", "right_lower_leg", FLEXION_AXES, (-150, 0)),
        _joint("left_knee", "left_upper_leg", "left_lower_leg", FLEXION_AXES, (-150, 0)),
        _joint("right_ankle", "right_lower_leg", "right_foot", FLEXION_AXES, (50, 130)),
        _joint("left_ankle", "left_lower_leg", "left_foot", FLEXION_AXES, (50, 130)),
    ),
    markers=(
        Marker("Hip", joints=("right_hip", "left_hip")),
        Marker("RHip", joints=("right_hip",)),
        Marker("RKnee", joints=("right_knee",)),
        Marker("RAnkle", joints=("right_ankle",)),
        Marker("LHip", joints=("left_hip",)),
        Marker("LKnee", joints=("left_knee",)),
        Marker("LAnkle", joints=("left_ankle",)),
        Marker("Neck", joints=("right_shoulder", "left_shoulder")),
        Marker("Head", "head", 1.0),
        Marker("RShoulder", joints=("right_shoulder",)),
        Marker("RElbow", joints=("right_elbow",)),
        Marker("RWrist", "right_lower_arm", 0.146 / (0.146 + 0.108)),
        Marker("LShoulder", joints=("left_shoulder",)),
        Marker("LElbow", joints=("left_elbow",)),
        Marker("LWrist", "left_lower_arm", 0.146 / (0.146 + 0.108)),
    ),
)

ANATOMIES: Mapping[str, Anatomy] = {anatomy.name: anatomy for anatomy in (TEN_PARTS, FOURTEEN_PARTS)}
