"""Joint angles in degrees for comparison with other systems, in the conventions of the ISB.

A joint's rotation maps the distal segment's frame to the proximal one's.  Segment frames are those of the ISB and of
OpenSim: X to the front, Y up along the segment, Z to the right.  All are parallel to the trunk's when the person is upright
with arms and legs hanging.  The joint coordinate system of Grood and Suntay (1983) - Z of the proximal segment, Y of the
distal one, and their common perpendicular - is the intrinsic sequence Z, X, Y, which Wu et al. (2002) recommend for hip
and spine and OpenSim uses for hips, lumbar joint and shoulders; Wu et al. (2005) describe the arm by plane of elevation and
elevation.  Inclinations of pelvis and trunk are relative to the vertical, after their heading (sequence Y, X, Z).  The
publications are cited from memory.

The first two angles of Z, X, Y depend only on the direction of the distal segment, that is on joint centres.  The third,
the axial rotation of a limb, follows from the plane of the flexed knee or elbow; that of a straight limb is not defined.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from zenocap.common.arrays import Bools, Floats
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.inverse_kinematics import WAIST
from zenocap.common.body.rotations import cardan_angles, euler_to_matrix, perpendicular, unit

JointRotations: TypeAlias = Mapping[str, Floats]
"""Rotations (n, 3, 3) by joint, distal to proximal segment, in the axes above; NaN where unknown.

`pelvis` and `trunk_inclination`: pelvis and trunk to the world, whose axes are Y up and two horizontal ones.  `trunk`:
trunk to pelvis.  `neck`: head to trunk.  `right_shoulder` ...: upper arm to trunk.  `right_hip` ...: thigh to pelvis, or
to the trunk of a body without a joint between them.
"""

JOINT_AXES = "zxy"
INCLINATION_AXES = "yxz"
INCLINATIONS = ("pelvis", "trunk_inclination")
SIDES = (("right", "r", 1.0), ("left", "l", -1.0))

# All values below are chosen by hand.
LEAST_FLEXION_DEG = 20.0  # of knee or elbow, for the axial rotation of thigh or upper arm: errors grow with 1 / sin
FROM_LOCK_DEG = 15.0  # smallest distance of a sequence's second angle from 90, where the first and third have one axis
ELEVATION_DEG = (20.0, 160.0)  # of the arm, within which its plane of elevation is defined


@dataclass(frozen=True)
class ClinicalAngle:
    """An angle in degrees.  joint: key of JointRotations.

    axis: of the joint's sequence, or `elevation` or `plane` of an arm.  sign: of the rotation about `axis`.
    hinge: joint whose flexion defines it, "" if none.  definition: meaning of positive values.
    """

    name: str
    joint: str
    axis: str
    sign: float
    definition: str
    hinge: str = ""


def _of_side(side: str, letter: str, out: float) -> tuple[ClinicalAngle, ...]:
    """Angles of one arm and leg.  out: sign of the side's lateral direction along Z."""

    def angle(name: str, joint: str, axis: str, sign: float, definition: str, hinge: str = "") -> ClinicalAngle:
        hinge = f"{side}_{hinge}" if hinge else ""
        return ClinicalAngle(f"{name}_{letter}", f"{side}_{joint}", axis, sign, definition, hinge)

    return (
        angle("hip_flexion", "hip", "z", 1.0, "thigh to the front"),
        angle("hip_adduction", "hip", "x", out, "thigh to the other leg"),
        angle("hip_rotation", "hip", "y", out, "thigh inward", "knee"),
        angle("knee_flexion", "knee", "z", -1.0, "heel to the buttock"),
        angle("ankle_dorsiflexion", "ankle", "z", 1.0, "toes up"),
        angle("shoulder_flexion", "shoulder", "z", 1.0, "upper arm to the front"),
        angle("shoulder_adduction", "shoulder", "x", out, "upper arm to the other arm"),
        angle("shoulder_rotation", "shoulder", "y", out, "upper arm inward", "elbow"),
        angle("shoulder_elevation", "shoulder", "elevation", 1.0, "upper arm away from hanging, 0 to 180"),
        angle("shoulder_plane", "shoulder", "plane", out, "plane of elevation: 0 sideways, 90 to the front"),
        angle("elbow_flexion", "elbow", "z", 1.0, "hand to the shoulder"),
    )


ANGLES: tuple[ClinicalAngle, ...] = (
    ClinicalAngle("pelvis_tilt", "pelvis", "z", -1.0, "top of the pelvis to the front (anterior)"),
    ClinicalAngle("pelvis_obliquity", "pelvis", "x", 1.0, "right hip down"),
    ClinicalAngle("trunk_forward_lean", "trunk_inclination", "z", -1.0, "shoulders to the front"),
    ClinicalAngle("trunk_lateral_lean", "trunk_inclination", "x", 1.0, "right shoulder down"),
    ClinicalAngle("trunk_flexion", "trunk", "z", -1.0, "trunk to the front of the pelvis"),
    ClinicalAngle("trunk_bending", "trunk", "x", 1.0, "trunk to the right of the pelvis"),
    ClinicalAngle("trunk_rotation", "trunk", "y", 1.0, "trunk to the left of the pelvis: right shoulder to the front"),
    ClinicalAngle("neck_flexion", "neck", "z", -1.0, "head to the front"),
    ClinicalAngle("neck_bending", "neck", "x", 1.0, "head to the right"),
    *(angle for side in SIDES for angle in _of_side(*side)),
)

# Columns: axes of the segment frame in the part's own frame, see `anatomy`.
_TRUNK = np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])  # the part has X to the left, Y up, Z to the front
_LIMB = np.array([[0.0, 0, 1], [0, -1, 0], [1, 0, 0]])  # hanging, the part has X to the right, Y down, Z to the front
_FOOT = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])  # standing, the part has X to the right, Y to the front, Z up
_HALF_TURN = np.diag([-1.0, 1.0, -1.0])  # about the segment's Y


def segment_axes(part: str) -> Floats:
    """Axes (3, 3) of the segment frame of a part, or of the world (""), in columns X front, Y up, Z right."""
    if part.endswith("foot"):
        return _FOOT
    return _LIMB if part.endswith(("arm", "leg")) else _TRUNK


def joint_rotations(anatomy: Anatomy, angles: Floats) -> dict[str, Floats]:
    """Joint rotations of poses.  angles: (n, angles) radians, ordered by `Anatomy.angles`; NaN where unknown.

    Bodies of ten parts have no `pelvis`, `trunk` and ankles.  Raises ValueError for an anatomy without a trunk.
    """
    if not {"torso", "chest"} & set(anatomy.parts):
        raise ValueError(f"anatomy {anatomy.name!r}: allowed: one with a torso, or with pelvis and chest")
    to_parent, first = {}, 0
    for joint in anatomy.joints:
        values = angles[:, first : first + len(joint.axes)]
        first += len(joint.axes)
        own, parent = segment_axes(joint.part), segment_axes(joint.parent)
        to_parent[joint.name] = parent.T @ euler_to_matrix(joint.axes, values) @ own
    rotations = {"neck": to_parent["neck"]}
    if "waist" in to_parent:
        rotations |= {"pelvis": to_parent["navel"], "trunk": to_parent["waist"]}
        rotations["trunk_inclination"] = to_parent["navel"] @ to_parent["waist"]
    else:
        rotations["trunk_inclination"] = to_parent["navel"]
    for side, _, _ in SIDES:
        for name in ("hip", "knee", "ankle", "shoulder", "elbow"):
            if f"{side}_{name}" in to_parent:
                rotations[f"{side}_{name}"] = to_parent[f"{side}_{name}"]
        # An elbow that flexes backward is one that flexes forward, with both segments turned by half a turn.
        backward = (angles[:, anatomy.index[f"{side}_elbow.x"]] < 0.0)[:, None, None]
        arm, forearm = rotations[f"{side}_shoulder"], rotations[f"{side}_elbow"]
        rotations[f"{side}_shoulder"] = np.where(backward, arm @ _HALF_TURN, arm)
        rotations[f"{side}_elbow"] = np.where(backward, _HALF_TURN @ forearm @ _HALF_TURN, forearm)
    return rotations


def with_rigid_trunk(rotations: JointRotations) -> dict[str, Floats]:
    """Joint rotations of a body whose trunk is one part, as of ten parts: hips and shoulders move in one frame.

    The trunk points from the hips to the shoulders; its lateral axis is the mean of hip line and shoulder line.
    """
    kept = {name: rotation for name, rotation in rotations.items() if name not in ("pelvis", "trunk")}
    if "trunk" not in rotations:
        return kept
    chest = rotations["trunk"]
    upper, right = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    y = unit(WAIST * upper + (1.0 - WAIST) * chest[:, :, 1])
    z = unit(perpendicular(right + chest[:, :, 2], y))
    whole_to_pelvis = np.stack([np.cross(y, z), y, z], axis=-1)
    pelvis_to_whole = np.swapaxes(whole_to_pelvis, 1, 2)
    for side, _, _ in SIDES:
        if f"{side}_hip" in kept:
            kept[f"{side}_hip"] = pelvis_to_whole @ kept[f"{side}_hip"]
        if f"{side}_shoulder" in kept:
            kept[f"{side}_shoulder"] = pelvis_to_whole @ chest @ kept[f"{side}_shoulder"]
    if "neck" in kept:
        kept["neck"] = pelvis_to_whole @ chest @ kept["neck"]
    if "pelvis" in rotations:
        kept["trunk_inclination"] = rotations["pelvis"] @ whole_to_pelvis
    return kept


def clinical_angles(rotations: JointRotations) -> dict[str, Floats]:
    """Angles (n,) in degrees by name, in the order of ANGLES, of the joints in `rotations`; NaN where not defined."""
    return {angle.name: _values(angle, rotations) for angle in ANGLES if angle.joint in rotations}


def other_solution(degrees: Floats) -> Floats:
    """The other three angles (n, 3) of the same rotations about three different axes, in [-180, 180)."""
    return within_half_a_turn(np.stack([degrees[:, 0] + 180.0, 180.0 - degrees[:, 1], degrees[:, 2] + 180.0], axis=-1))


def within_half_a_turn(degrees: Floats) -> Floats:
    """Angles equal to `degrees` modulo a full turn, in [-180, 180)."""
    wrapped: Floats = (degrees + 180.0) % 360.0 - 180.0
    return wrapped


def _of_raised_arms(degrees: Floats) -> Floats:
    """Of both solutions (n, 3) the one with less flexion and adduction: an arm raised sideways has no flexion."""
    other = other_solution(degrees)
    nearer = np.abs(other[:, :2]).sum(axis=1) < np.abs(degrees[:, :2]).sum(axis=1)
    return np.where(nearer[:, None], other, degrees)


def _values(angle: ClinicalAngle, rotations: JointRotations) -> Floats:
    rotation = rotations[angle.joint]
    front, up, right = np.moveaxis(-rotation[:, :, 1], -1, 0)  # of the hanging limb's direction
    with np.errstate(invalid="ignore"):
        elevation = np.degrees(np.arctan2(np.hypot(front, right), -up))
        if angle.axis == "elevation":
            return np.asarray(elevation)
        if angle.axis == "plane":
            plane = np.degrees(np.arctan2(front, angle.sign * right))
            return _where((elevation >= ELEVATION_DEG[0]) & (elevation <= ELEVATION_DEG[1]), plane)
        axes = INCLINATION_AXES if angle.joint in INCLINATIONS else JOINT_AXES
        found = np.degrees(cardan_angles(axes, rotation))
        if angle.joint.endswith("shoulder"):
            found = _of_raised_arms(found)
        values = angle.sign * found[:, axes.index(angle.axis)]
        if angle.axis == axes[1]:
            return values
        defined = np.abs(np.abs(found[:, 1]) - 90.0) >= FROM_LOCK_DEG
        if angle.hinge:
            if angle.hinge not in rotations:
                return np.full(len(values), np.nan)
            bend = np.degrees(cardan_angles(JOINT_AXES, rotations[angle.hinge])[:, 0])
            defined &= np.abs(bend) >= LEAST_FLEXION_DEG
        return _where(defined, values)


def _where(defined: Bools, values: Floats) -> Floats:
    return np.where(defined, values, np.nan)
