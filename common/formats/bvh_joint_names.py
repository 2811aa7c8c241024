"""Joint centres of BVH files (HALPE names, metres, Y up) by common naming conventions.

Supported names: MotionBuilder and CMU (LeftUpLeg), Mixamo (mixamorig:LeftUpLeg), Reallusion (CC_Base_L_Thigh), Daz and
Poser (lThigh), 3ds Max (Bip01 L Thigh), Blender (thigh.L, DEF-thigh.L), Unreal (thigh_l), Unity (UpperLeg_L, LowerLeg_L),
VRM (J_Bip_L_UpperLeg), Xsens (LeftHip), depth cameras (HipLeft), SMPL (L_Hip) and zenocap.  Skeletons with other names are
taken by their structure, see `bvh_structure`.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Bools, Floats
from zenocap.common.body.inverse_kinematics import WAIST
from zenocap.common.errors import UserError
from zenocap.common.formats.bvh_reader import END, Bvh, read_bvh
from zenocap.common.formats.bvh_structure import StructureError, roles_by_structure
from zenocap.common.formats.file_warnings import warn_of_file
from zenocap.common.formats.joint_map import UPS, JointMap
from zenocap.common.formats.joint_names import STEMS, plain_name
from zenocap.common.formats.trajectories import MATRICES, Trajectories

CROWNS = ("headend", "headtopend", "headtop", "headnub")
REQUIRED = ("Head", *(f"{letter}{role}" for letter in "RL" for role in STEMS if role != "Toe"))
METRES: Mapping[str, float] = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "inch": 0.0254, "CMU's 0.45 inches": 0.0254 / 0.45}
LEG_M = (0.60, 1.10)  # hip to ankle of an adult; narrower than the ratio of any two units; chosen by hand
LEG_SHARE = 0.491  # hip to ankle over body height, Drillis and Contini (1966) as in Winter; cited from memory
CROWN_SHARE = 0.125  # height of the crown above the joint of the head, over body height; chosen by hand
NEAREST_CROWN_M = 0.05  # smallest length of a head bone that ends at the crown; chosen by hand
STRAIGHT = 0.7  # quantile of the hips' extension above which the person stands; chosen by hand


def read_bvh_centres(path: Path, joints: JointMap | None = None) -> Trajectories:
    """Read the joint centres of a BVH file: the fifteen HALPE names, `Waist`, and `RToe`, `LToe` if present.

    Up is the direction of the head, and knees flex backward, which detects left-handed worlds.  The unit is that in which
    the legs have an adult's length.  The heading in the world is the file's.  joints: names of joints that are not
    recognized.  Raises UserError.
    """
    return centres_of(read_bvh(path), path, joints)


def centres_of(file: Bvh, path: Path, joints: JointMap | None = None) -> Trajectories:
    """See `read_bvh_centres`.  path: of the file, for errors."""
    at = joint_roles(file, path, note=True, joints=joints)
    points = {role: file.points[:, k] for role, k in at.items()}
    to_metres, to_y_up = _to_metres(points, path), to_y_up_of(points, joints)
    centres = {role: place @ (to_metres * to_y_up).T for role, place in points.items()}
    centres["Hip"] = 0.5 * (centres["RHip"] + centres["LHip"])
    centres["Neck"] = 0.5 * (centres["RShoulder"] + centres["LShoulder"])
    trunk, standing = centres["Neck"] - centres["Hip"], _standing(centres)
    pelvis = common_ancestor(file.parents, at["RHip"], at["LHip"])
    upward = _fixed_line(to_y_up @ file.rotations[:, pelvis], trunk, standing)
    centres["Waist"] = centres["Hip"] + WAIST * np.linalg.norm(trunk, axis=1, keepdims=True) * upward
    end = _bone_end(file, at["Head"])
    if end is not None:
        centres["Head"] = file.points[:, end] @ (to_metres * to_y_up).T
    if end is None or _median_length(centres["Head"] - points["Head"] @ (to_metres * to_y_up).T) < NEAREST_CROWN_M:
        height = _leg(centres) / LEG_SHARE
        upward = _fixed_line(to_y_up @ file.rotations[:, at["Head"]], trunk, standing)
        centres["Head"] = points["Head"] @ (to_metres * to_y_up).T + CROWN_SHARE * height * upward
    names = tuple(centres)
    frames = np.arange(len(trunk), dtype=np.int64)
    return Trajectories(names, frames, frames / file.rate, np.stack([centres[name] for name in names], axis=1), file.rate)


def joint_roles(file: Bvh, path: Path, *, note: bool = False, joints: JointMap | None = None) -> dict[str, int]:
    """Indices of joints by role, see `roles_of`, or where names are missing there, by the structure of the skeleton.

    path: for errors.  note: log which joints were chosen by the structure.  joints: where both fail.  Raises UserError
    with both reasons.
    """
    given = {} if joints is None else _given(file, path, joints)
    named = True
    try:
        found = roles_of(file.names, path, given)
    except UserError as unnamed:
        named = False
        try:
            found = roles_by_structure(file) | given
        except StructureError as error:
            raise UserError(f"{unnamed}; nor does its structure say: {error}; a joint map (--joints) helps") from None
    _check_different(path, file.names, found, given)
    if note and not named:
        chosen = ", ".join(f"{role} = {file.names[k]}" for role, k in found.items())
        warn_of_file(path, f"joints taken by the structure of the skeleton, as some names are not known: {chosen}")
    return found


def _given(file: Bvh, path: Path, joints: JointMap) -> dict[str, int]:
    """Indices of the joints of a map by role.  Raises UserError."""
    joints.check(path, file.names)
    for role, names in joints.joints.items():
        if len(names) > 1:
            raise UserError(f"{joints.path}: joints.{role} = {list(names)}: allowed for {path}: one name")
    return {role: file.names.index(names[0]) for role, names in joints.joints.items()}


def _check_different(path: Path, names: tuple[str, ...], found: dict[str, int], given: Mapping[str, int]) -> None:
    """Raise UserError where a joint of the map has another role too."""
    for role, joint in given.items():
        other = next((one for one, k in found.items() if k == joint and one != role), None)
        if other is not None:
            taken = f"{path}: joint {names[joint]!r} is {role} by the joint map, and {other} without it"
            raise UserError(f"{taken}: allowed: a line for {other} in the joint map")


def roles_of(names: tuple[str, ...], path: Path, given: Mapping[str, int] | None = None) -> dict[str, int]:
    """Indices of joints by role: `Head`, and Hip, Knee, Ankle, Shoulder, Elbow, Wrist and Toe prefixed by R or L.

    `Toe` is optional.  given: roles that need no known name.  Raises UserError that lists the missing roles and the joints
    of the file.
    """
    by_name = {plain_name(name): k for k, name in reversed(list(enumerate(names)))}
    found: dict[str, int] = dict(given or {})
    for letter in "RL":
        for role, stems in STEMS.items():
            if f"{letter}{role}" in found:
                continue
            joint = next((by_name[f"{letter}.{stem}"] for stem in stems if f"{letter}.{stem}" in by_name), None)
            if role == "Toe" and (joint is None or joint == found.get(f"{letter}Ankle")):
                ankle = found.get(f"{letter}Ankle")
                joint = by_name.get(plain_name(names[ankle] + END)) if ankle is not None else None
            if joint is not None:
                found[f"{letter}{role}"] = joint
    if "head" in by_name:
        found.setdefault("Head", by_name["head"])
    missing = [role for role in REQUIRED if role not in found]
    if missing:
        joint_names = ", ".join(name for name in names if not name.endswith(END))
        known = ", ".join(STEMS.get(missing[0].lstrip("RL"), ("head",)))
        allowed = f"allowed for {missing[0]}{'' if missing[0] == 'Head' else ', with its side'}: {known}"
        raise UserError(f"{path}: no joint for {', '.join(missing)}; there are: {joint_names[:600]}; {allowed}")
    return found


def _to_metres(points: Mapping[str, Floats], path: Path) -> float:
    leg = _leg(points)
    for metres in METRES.values():
        if LEG_M[0] <= leg * metres <= LEG_M[1]:
            return metres
    known = ", ".join(METRES)
    raise UserError(f"{path}: a leg is {leg:.4g} long: allowed: {LEG_M[0]} to {LEG_M[1]} m in {known}, or give the unit")


def _leg(points: Mapping[str, Floats]) -> float:
    """Length of the leg, hip to ankle, in the file's unit."""
    return sum(_median_length(points[a] - points[b]) for a, b in (("RHip", "RKnee"), ("RKnee", "RAnkle")))


def _median_length(vectors: Floats) -> float:
    return float(np.median(np.linalg.norm(vectors, axis=1)))


def to_y_up_of(points: Mapping[str, Floats], joints: JointMap | None = None) -> Floats:
    """Matrix (3, 3) from the file's axes to Y up: up is from ankles to shoulders, and knees point forward.

    joints: its `up`, if given, is the axis.
    """
    ankles, shoulders = points["RAnkle"] + points["LAnkle"], points["RShoulder"] + points["LShoulder"]
    up = np.mean(shoulders - ankles, axis=0)
    axis = UPS.index(joints.up) if joints is not None and joints.up is not None else int(np.argmax(np.abs(up)))
    matrix = y_up_matrix(axis, bool(up[axis] < 0 and (joints is None or joints.up is None)))
    left = (points["LHip"] - points["RHip"]) @ matrix.T
    front = np.zeros_like(left)
    for side in "RL":
        hip, knee, ankle = (points[f"{side}{name}"] @ matrix.T for name in ("Hip", "Knee", "Ankle"))
        front += 2.0 * knee - hip - ankle
    if float(np.mean(left[:, 2] * front[:, 0] - left[:, 0] * front[:, 2])) > 0.0:  # Y component of left × front: down
        matrix[0] *= -1.0
    return matrix


def y_up_matrix(axis: int, downwards: bool = False) -> Floats:
    """Rotation (3, 3) of an axis, 0 to 2, that points up, or downwards, to Y."""
    matrix = (np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]), np.eye(3), MATRICES["z-up"].T)[axis].copy()
    if downwards:
        matrix[:, [axis, (axis + 1) % 3]] *= -1.0
    return matrix


def _standing(centres: Mapping[str, Floats]) -> Bools:
    """(n,) whether the trunk is in line with the thighs, compared with the other frames."""
    thighs = centres["RHip"] + centres["LHip"] - centres["RKnee"] - centres["LKnee"]
    trunk = centres["Neck"] - centres["Hip"]
    straight = np.sum(thighs * trunk, axis=1) / (np.linalg.norm(thighs, axis=1) * np.linalg.norm(trunk, axis=1))
    standing: Bools = straight >= np.quantile(straight, STRAIGHT)
    return standing


def _fixed_line(rotations: Floats, direction: Floats, standing: Bools) -> Floats:
    """Unit vectors (n, 3) of the line fixed in a bone that is parallel to `direction` (n, 3) while the person stands."""
    own = np.einsum("nji,nj->ni", rotations[standing], direction[standing]).mean(axis=0)
    carried: Floats = rotations @ (own / np.linalg.norm(own))
    return carried


def common_ancestor(parents: tuple[int, ...], one: int, other: int) -> int:
    while one != other:  # parents come before their children
        one, other = (parents[one], other) if one > other else (one, parents[other])
    return one


def _bone_end(file: Bvh, joint: int) -> int | None:
    """Index of a joint's End Site, or of the joint named as its end; None without one."""
    for k, (name, parent) in enumerate(zip(file.names, file.parents, strict=True)):
        if parent == joint and plain_name(name) in CROWNS:
            return k
    return None
