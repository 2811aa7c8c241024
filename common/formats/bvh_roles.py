"""What the joints of a BVH file are, whoever named them: joint centres by HALPE name, metres, Y up.

Known are the names of MotionBuilder and CMU (LeftUpLeg), Mixamo (mixamorig:LeftUpLeg), Reallusion (CC_Base_L_Thigh),
Daz and Poser (lThigh), 3ds Max (Bip01 L Thigh), Blender (thigh.L), SMPL (L_Hip), and our own.
"""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from common.body.anatomy import Floats
from common.formats.axes import MATRICES, PER_METRE, Axes, Unit
from common.formats.bvh_reading import END, Bvh, read_bvh
from common.formats.trc import FormatError, Trajectories

# By role, in the order in which they are looked for; without side, in lower case, letters only.
STEMS: Mapping[str, tuple[str, ...]] = {
    "Hip": ("upleg", "thigh", "upperleg", "femur", "hip"),
    "Knee": ("knee", "leg", "shin", "calf", "lowerleg", "lowleg", "tibia"),
    "Ankle": ("ankle", "foot"),
    "Shoulder": ("arm", "shldr", "upperarm", "uparm", "humerus", "shoulder"),
    "Elbow": ("elbow", "forearm", "lowerarm", "lowarm"),
    "Wrist": ("wrist", "hand"),
    "Toe": ("toebase", "toe", "toes", "ball", "foot"),
}
CROWNS = ("headend", "headtopend", "headtop", "headnub")
OPTIONAL = ("Toe",)
PREFIX = re.compile(r"^(.*:|mixamorig\d*_?|cc_base_|bip\d*[ _]|rl_)", re.IGNORECASE)
SIDED = (
    re.compile(r"^(left|right|[lr](?=[A-Z _.\-]))[ _.\-]*(.*)$", re.IGNORECASE),
    re.compile(r"^(.*?)[ _.\-](left|right|l|r)$", re.IGNORECASE),
)
LETTER_SIDE = re.compile(r"^[lr](?![A-Z _.\-])")  # `leg` is not the left eg

METRES: Mapping[str, float] = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "inch": 0.0254, "CMU's 0.45 inches": 0.0254 / 0.45}
LEG_M = (0.60, 1.10)  # hip to ankle of a grown person; narrower than the step from unit to unit
LEG_SHARE = 0.491  # hip to ankle over body height, Drillis and Contini (1966) as in Winter, from memory
CROWN_SHARE = 0.125  # of the crown above the joint of the head, over body height; a rough estimate
WAIST_SHARE = 0.35  # of the spine's bend between hip line and shoulder line, as `common.body.from_centres` has it
NEAREST_CROWN_M = 0.05
STRAIGHT = 0.7  # quantile of the straightness of the hips above which a person stands


def read_bvh_centres(path: Path, *, axes: Axes | None = None, unit: Unit | None = None) -> Trajectories:
    """Joint centres of the person in a BVH file: the fifteen HALPE names, `Waist`, and `RToe`, `LToe` where there are.

    Without `axes` up is where the head is and a mirrored (left-handed) world is turned by the knees; without `unit` it is
    that in which the legs are a grown person's.  The heading in the world stays the file's.  Raises FormatError.
    """
    return centres_of(read_bvh(path), path, axes, unit)


def centres_of(file: Bvh, path: Path, axes: Axes | None = None, unit: Unit | None = None) -> Trajectories:
    """See `read_bvh_centres`; path: of the file, for errors."""
    at = roles_of(file.names, path)
    points = {role: file.points[:, k] for role, k in at.items()}
    to_metres = 1.0 / PER_METRE[unit] if unit else _to_metres(points, path)
    to_ours = MATRICES[axes].T if axes else _to_ours(points)
    ours = {role: place @ (to_metres * to_ours).T for role, place in points.items()}
    ours["Hip"] = 0.5 * (ours["RHip"] + ours["LHip"])
    ours["Neck"] = 0.5 * (ours["RShoulder"] + ours["LShoulder"])
    trunk, standing = ours["Neck"] - ours["Hip"], _standing(ours)
    pelvis = _common_ancestor(file.parents, at["RHip"], at["LHip"])
    upward = _carried(to_ours @ file.rotations[:, pelvis], trunk, standing)
    ours["Waist"] = ours["Hip"] + WAIST_SHARE * np.linalg.norm(trunk, axis=1, keepdims=True) * upward
    end = _bone_end(file, at["Head"])
    if end is not None:
        ours["Head"] = file.points[:, end] @ (to_metres * to_ours).T
    if end is None or _median_length(ours["Head"] - points["Head"] @ (to_metres * to_ours).T) < NEAREST_CROWN_M:
        height = _leg(ours) / LEG_SHARE
        upward = _carried(to_ours @ file.rotations[:, at["Head"]], trunk, standing)
        ours["Head"] = points["Head"] @ (to_metres * to_ours).T + CROWN_SHARE * height * upward
    names = tuple(ours)
    frames = np.arange(len(trunk), dtype=np.int64)
    return Trajectories(names, frames, frames / file.rate, np.stack([ours[name] for name in names], axis=1), file.rate)


def roles_of(names: tuple[str, ...], path: Path) -> dict[str, int]:
    """Index by role: `Head`, and with R and L before them Hip, Knee, Ankle, Shoulder, Elbow, Wrist and, if any, Toe.

    Raises FormatError that names the roles without joint and the joints there are.
    """
    by_name = {_plain(name): k for k, name in reversed(list(enumerate(names)))}
    found: dict[str, int] = {}
    for letter in "RL":
        for role, stems in STEMS.items():
            joint = next((by_name[f"{letter}.{stem}"] for stem in stems if f"{letter}.{stem}" in by_name), None)
            if role == "Toe" and (joint is None or joint == found.get(f"{letter}Ankle")):
                ankle = found.get(f"{letter}Ankle")
                joint = by_name.get(_plain(names[ankle] + END)) if ankle is not None else None
            if joint is not None:
                found[f"{letter}{role}"] = joint
    if "head" in by_name:
        found["Head"] = by_name["head"]
    wanted = ["Head", *(f"{letter}{role}" for letter in "RL" for role in STEMS if role not in OPTIONAL)]
    missing = [role for role in wanted if role not in found]
    if missing:
        there = ", ".join(name for name in names if not name.endswith(END))
        raise FormatError(f"{path}: no joint for {', '.join(missing)}; there are: {there[:600]}")
    return found


def _plain(name: str) -> str:
    """`R.` or `L.` and the letters of the rest, in lower case; no side without one."""
    rest = name
    while (short := PREFIX.sub("", rest)) != rest:
        rest = short
    side = ""
    if not LETTER_SIDE.match(rest):
        for pattern, order in ((SIDED[0], (1, 2)), (SIDED[1], (2, 1))):
            if match := pattern.match(rest):
                side, rest = match[order[0]][0].upper() + ".", match[order[1]]
                break
    return side + re.sub(r"[^a-z]", "", rest.lower())


def _to_metres(points: Mapping[str, Floats], path: Path) -> float:
    leg = _leg(points)
    for metres in METRES.values():
        if LEG_M[0] <= leg * metres <= LEG_M[1]:
            return metres
    known = ", ".join(METRES)
    raise FormatError(f"{path}: a leg is {leg:.4g} long: allowed: {LEG_M[0]} to {LEG_M[1]} m in {known}, or give the unit")


def _leg(points: Mapping[str, Floats]) -> float:
    """Hip to ankle along the stretched leg."""
    return sum(_median_length(points[a] - points[b]) for a, b in (("RHip", "RKnee"), ("RKnee", "RAnkle")))


def _median_length(vectors: Floats) -> float:
    return float(np.median(np.linalg.norm(vectors, axis=1)))


def _to_ours(points: Mapping[str, Floats]) -> Floats:
    """(3, 3) from the file's axes to ours: up is from ankles to shoulders, and knees bend to the front."""
    ankles, shoulders = points["RAnkle"] + points["LAnkle"], points["RShoulder"] + points["LShoulder"]
    up = np.mean(shoulders - ankles, axis=0)
    axis = int(np.argmax(np.abs(up)))
    matrix = (np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]), np.eye(3), MATRICES["z-up"].T)[axis].copy()
    if up[axis] < 0:
        matrix[:, [axis, (axis + 1) % 3]] *= -1.0
    left = (points["LHip"] - points["RHip"]) @ matrix.T
    front = np.zeros_like(left)
    for side in "RL":
        hip, knee, ankle = (points[f"{side}{name}"] @ matrix.T for name in ("Hip", "Knee", "Ankle"))
        front += 2.0 * knee - hip - ankle
    if float(np.mean(left[:, 2] * front[:, 0] - left[:, 0] * front[:, 2])) > 0.0:  # Y component of left × front: down
        matrix[0] *= -1.0
    return matrix


def _standing(ours: Mapping[str, Floats]) -> NDArray[np.bool_]:
    """(n,) whether the trunk is about in line with the thighs, as of all frames."""
    thighs = ours["RHip"] + ours["LHip"] - ours["RKnee"] - ours["LKnee"]
    trunk = ours["Neck"] - ours["Hip"]
    straight = np.sum(thighs * trunk, axis=1) / (np.linalg.norm(thighs, axis=1) * np.linalg.norm(trunk, axis=1))
    standing: NDArray[np.bool_] = straight >= np.quantile(straight, STRAIGHT)
    return standing


def _carried(rotations: Floats, direction: Floats, standing: NDArray[np.bool_]) -> Floats:
    """(n, 3) unit: the line fixed in a bone that points along `direction` (n, 3) while the person stands."""
    own = np.einsum("nji,nj->ni", rotations[standing], direction[standing]).mean(axis=0)
    carried: Floats = rotations @ (own / np.linalg.norm(own))
    return carried


def _common_ancestor(parents: tuple[int, ...], one: int, other: int) -> int:
    while one != other:  # parents come before their children
        one, other = (parents[one], other) if one > other else (one, parents[other])
    return one


def _bone_end(file: Bvh, joint: int) -> int | None:
    """The End Site of a joint, or what is named as its end."""
    for k, (name, parent) in enumerate(zip(file.names, file.parents, strict=True)):
        if parent == joint and _plain(name) in CROWNS:
            return k
    return None
