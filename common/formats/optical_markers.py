"""Joint centres from skin markers: Plug-in Gait, Helen Hayes, sets with medial markers.

Hip: regression on width and depth of the pelvis, Harrington et al. (2007), Prediction of the hip joint centre in adults,
children, and patients with cerebral palsy, the equations with one predictor.  Shoulder: below the marker on the acromion by
17 % of the distance of both, Rab, Petuskey and Bagley (2002), A method for determination of upper extremity kinematics.
Knee, ankle, elbow: the middle of a lateral and a medial marker.  Without a medial one as in Plug-in Gait (Davis et al.
1991): half the joint's width from the lateral marker, with a right angle at the joint between marker and proximal joint, in
the plane of a marker on thigh or shank.  Without such a marker, and at the elbow, along the hinge's axis: perpendicular to
the plane of the bent limb, for a straight limb interpolated between bent ones, or that of the hips or shoulders.
Wrist: the middle of two markers, or one.
"""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Bools, Floats
from zenocap.common.body.inverse_kinematics import CLEAR, hinge_axes, interpolated
from zenocap.common.body.rotations import perpendicular, shortest_rotation, unit
from zenocap.common.errors import UserError
from zenocap.common.formats.file_warnings import warn_of_file
from zenocap.common.formats.joint_names import plain_name

# Names of markers without side, letters only; `.` stands for the side.  RKNE, R.Knee.Medial.
MARKERS: Mapping[str, tuple[str, ...]] = {
    ".asis": ("asi", "asis"),
    ".psis": ("psi", "psis"),
    "sacrum": ("sacr", "sacrum", "vsacral", "sac"),
    ".thigh": ("thi", "thigh", "thighupper"),
    ".shank": ("tib", "shank", "shankupper"),
    ".knee": ("kne", "knee", "kneelat", "kneelateral", "lfc", "lknee", "kneel"),
    ".knee_medial": ("knm", "kneemedial", "kneemed", "mkne", "mfc", "mknee", "knem"),
    ".ankle": ("ank", "ankle", "anklelat", "anklelateral", "lmal", "lankle"),
    ".ankle_medial": ("med", "mma", "anklemedial", "anklemed", "mank", "mmal", "mankle"),
    ".toe": ("toe", "toetip", "mt"),
    ".shoulder": ("sho", "shoulder", "acr", "acromium", "acromion"),
    ".elbow": ("elb", "elbow", "elbowlat", "elbowlateral", "lel", "lelbow"),
    ".elbow_medial": ("elm", "elbm", "elbowmedial", "elbowmed", "mel", "melb", "melbow"),
    ".wrist": ("wra", "lwrist", "wristlat", "faradius", "wri", "wrist", "wristradius"),
    ".wrist_medial": ("wrb", "mwrist", "wristmed", "faulna", "wristulna"),
    ".head_front": ("fhd",),
    ".head_back": ("bhd",),
    "crown": ("tophead", "vertex"),
}
OPTIONAL = (
    ".thigh", ".shank", ".knee_medial", ".ankle_medial", ".toe", ".elbow_medial", ".wrist_medial", ".head_front",
    ".head_back", "crown",
)  # fmt: skip
SHOWN: Mapping[str, str] = {
    ".asis": ".ASI", ".psis": ".PSI (or SACR)", ".knee": ".KNE", ".ankle": ".ANK", ".shoulder": ".SHO", ".elbow": ".ELB",
    ".wrist": ".WRA",
}  # fmt: skip

SEPARATED = re.compile(r"[ _.\-]")
SIDES = (("R", -1.0), ("L", 1.0))  # and the sign of inwards, of an axis to the right

# Harrington et al. (2007): millimetres; front, up, outwards from the middle of the ASIS; depth PD, width PW of the pelvis.
HIP_FRONT, HIP_UP, HIP_OUT = (-0.24, -9.9), (-0.30, -10.9), (0.33, 7.3)
SHOULDER_DROP = 0.17  # Rab et al. (2002)
# From a lateral marker to the joint centre, metres: half the breadth of the joint of an average adult and 7 mm of the
# marker; chosen by hand.
KNEE_M, ANKLE_M, ELBOW_M = 0.060, 0.043, 0.042
ROUNDS = 4  # of the plane of a bent limb by its centres and the centres by that plane; chosen by hand
CROWN_M = 0.06  # crown above the middle of the markers of the head, along the line from the shoulders; chosen by hand
LEAST_WAND_M = 0.015  # of the marker of thigh or shank from the line of the segment, to give its plane; chosen by hand
# Largest median error of a file, mm, of the centres of knees and ankles without and with the markers that give the
# plane, from those that Plug-in Gait wrote into five public C3D files.
WITHOUT_PLANE_MM = {"knee": (104, 21), "ankle": (98, 14)}
PLANES = (("knee", "thigh", "THI", "KNM"), ("ankle", "shank", "TIB", "MED"))  # joint, its wand, their names, medial


def markers_of(points: Mapping[str, Floats]) -> dict[str, Floats]:
    """Markers (n, 3) by the names of MARKERS, with the side instead of the point: `R.asis` as `Rasis`."""
    by_name = {_plain(name): place for name, place in reversed(list(points.items()))}
    found: dict[str, Floats] = {}
    for marker, names in MARKERS.items():
        for side in "RL" if marker.startswith(".") else ("",):
            own = next((name for one in names if (name := f"{side}.{one}" if side else one) in by_name), None)
            if own is not None:
                found[f"{side}{marker.lstrip('.')}"] = by_name[own]
    return found


def _plain(name: str) -> str:
    """As `plain_name`, also of names in small letters, and without the ending of the markers of OpenCap and Pose2Sim."""
    plain = plain_name(name.upper() if name == name.lower() and not SEPARATED.search(name) else name)
    return plain.removesuffix("study")


def missing_markers(markers: Mapping[str, Floats]) -> list[str]:
    """Plug-in Gait's names of those that are needed and not there."""
    lacking = []
    for marker in MARKERS:
        if not marker.startswith(".") or marker in OPTIONAL or (marker == ".psis" and "sacrum" in markers):
            continue
        lacking += [SHOWN[marker].replace(".", side) for side in "LR" if f"{side}{marker[1:]}" not in markers]
    return lacking


def optical_centres(markers: Mapping[str, Floats], path: Path) -> dict[str, Floats]:
    """Joint centres (n, 3) by HALPE name, NaN where a marker of the joint is missing.

    markers: see `markers_of`, metres, right-handed.  path: for errors.  Raises UserError where a marker is in no frame.
    """
    known: dict[str, Bools] = {name: np.all(np.isfinite(points), axis=1) for name, points in markers.items()}
    if empty := [name for name, rows in known.items() if not rows.any() and f".{name[1:]}" not in OPTIONAL]:
        raise UserError(f"{path}: marker {', '.join(empty)}: in no frame: allowed: in one or more")
    at = {name: interpolated(points) for name, points in markers.items() if known[name].any()}
    right, up = _pelvis(at)
    found: dict[str, Floats] = {}
    drop = SHOULDER_DROP * np.linalg.norm(at["Lshoulder"] - at["Rshoulder"], axis=1, keepdims=True)
    for side, sign in SIDES:
        found[f"{side}Hip"] = _hip(at, side, right, up)
        hip, knee, ankle = found[f"{side}Hip"], at[f"{side}knee"], at[f"{side}ankle"]
        for _ in range(ROUNDS):
            bend = sign * _bend(hip, knee, ankle, -1.0, up, right)
            knee = _hinge(at, side, "knee", hip, _from_wand(at, side, "thigh", "knee", hip, bend), KNEE_M)
            ankle = _hinge(at, side, "ankle", knee, _from_wand(at, side, "shank", "ankle", knee, bend), ANKLE_M)
        found |= {f"{side}Knee": knee, f"{side}Ankle": ankle}
    _warn_of_planes(at, found, path)
    middle = 0.5 * (found["RHip"] + found["LHip"])
    trunk = unit(0.5 * (at["Rshoulder"] + at["Lshoulder"]) - middle)
    across = unit(perpendicular(at["Rshoulder"] - at["Lshoulder"], trunk))
    for side, sign in SIDES:
        found[f"{side}Shoulder"] = at[f"{side}shoulder"] - drop * trunk
        found[f"{side}Wrist"] = _middle(at, f"{side}wrist", f"{side}wrist_medial")
        shoulder, elbow, wrist = found[f"{side}Shoulder"], at[f"{side}elbow"], found[f"{side}Wrist"]
        inwards = sign * _bend(shoulder, elbow, wrist, 1.0, trunk, across)
        found[f"{side}Elbow"] = _hinge(at, side, "elbow", shoulder, inwards, ELBOW_M)
        if f"{side}toe" in at:
            found[f"{side}Toe"] = at[f"{side}toe"]
    shoulders = 0.5 * (found["RShoulder"] + found["LShoulder"])
    head = [at[name] for name in ("Rhead_front", "Lhead_front", "Rhead_back", "Lhead_back") if name in at]
    if "crown" in at:
        found["Head"] = at["crown"]
    elif len(head) == 4:
        found["Head"] = np.mean(head, axis=0) + CROWN_M * unit(np.mean(head, axis=0) - shoulders)
    for name in found:
        found[name] = np.where(_usable(name, known)[:, None], found[name], np.nan)
    return found


def _pelvis(at: Mapping[str, Floats]) -> tuple[Floats, Floats]:
    """Unit axes (n, 3) of the pelvis: to the right, and up, perpendicular to the plane of ASIS and PSIS."""
    right = unit(at["Rasis"] - at["Lasis"])
    forward = unit(perpendicular(0.5 * (at["Rasis"] + at["Lasis"]) - _back(at), right))
    return right, np.cross(right, forward)


def _back(at: Mapping[str, Floats]) -> Floats:
    """(n, 3) middle of the PSIS, or the sacrum."""
    if "Rpsis" in at and "Lpsis" in at:
        return 0.5 * (at["Rpsis"] + at["Lpsis"])
    return at["sacrum"]


def _hip(at: Mapping[str, Floats], side: str, right: Floats, up: Floats) -> Floats:
    """(n, 3) centre of the hip.  right, up: unit axes of the pelvis."""
    front = np.cross(up, right)
    middle = 0.5 * (at["Rasis"] + at["Lasis"])
    width = float(np.median(np.linalg.norm(at["Rasis"] - at["Lasis"], axis=1)))
    depth = float(np.median(np.linalg.norm(middle - _back(at), axis=1)))
    forwards, upwards, outwards = (
        slope * size + constant / 1000.0
        for (slope, constant), size in ((HIP_FRONT, depth), (HIP_UP, width), (HIP_OUT, width))
    )
    centre: Floats = middle + forwards * front + upwards * up + outwards * (right if side == "R" else -right)
    return centre


def _bend(start: Floats, hinge: Floats, end: Floats, flexion: float, up: Floats, right: Floats) -> Floats:
    """Unit axes (n, 3) of the hinge of a limb, for a hanging one to the person's right, smooth over the rows.

    up, right: unit axes (n, 3) of the part that the limb hangs from; where it is straight, the axis is carried from there.
    """
    upper, lower = unit(hinge - start), unit(end - hinge)
    middle = unit(np.cross(up, right) - up)  # forwards and down: farthest from where limbs never point
    natural = np.einsum("nij,nj->ni", shortest_rotation(middle, upper), right)
    return hinge_axes(upper, ((flexion * np.cross(upper, lower), CLEAR**-4, 4),), natural)


def _hinge(at: Mapping[str, Floats], side: str, joint: str, start: Floats, inwards: Floats, offset: float) -> Floats:
    """(n, 3) centre of a hinge.  start: of the segment that ends there.  inwards: unit (n, 3); offset: metres."""
    lateral, medial = at[f"{side}{joint}"], at.get(f"{side}{joint}_medial")
    if medial is not None:
        return 0.5 * (lateral + medial)
    along = lateral - start
    length = np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 2.0 * offset)
    back, beside = offset**2 / length, offset * np.sqrt(1.0 - (offset / length) ** 2)
    centre: Floats = lateral - back * unit(along) + beside * unit(perpendicular(inwards, unit(along)))
    return centre


def _from_wand(at: Mapping[str, Floats], side: str, wand: str, joint: str, start: Floats, otherwise: Floats) -> Floats:
    """Directions (n, 3) inwards in the plane of the segment with its marker, away from that; without one, `otherwise`.

    start: (n, 3) of the segment.  `otherwise` also where the marker is nearly in line with the segment.
    """
    beside = _beside(at, side, wand, joint, start)
    return otherwise if beside is None else -beside


def _beside(at: Mapping[str, Floats], side: str, wand: str, joint: str, start: Floats) -> Floats | None:
    """(n, 3) of the marker of thigh or shank from the line of the segment; None without one, or nearly in line."""
    if f"{side}{wand}" not in at:
        return None
    lateral = at[f"{side}{joint}"]
    beside = perpendicular(at[f"{side}{wand}"] - lateral, unit(lateral - start))
    return beside if float(np.median(np.linalg.norm(beside, axis=1))) >= LEAST_WAND_M else None


def _warn_of_planes(at: Mapping[str, Floats], found: Mapping[str, Floats], path: Path) -> None:
    """Warn of knees and ankles whose plane no marker gives.

    at: markers (n, 3), see `markers_of`.  found: centres (n, 3) by HALPE name.  path: of the file.
    """
    parts = []
    for (joint, wand, own, medial), above in zip(PLANES, ("Hip", "Knee"), strict=True):
        open_sides = [
            side
            for side in "LR"
            if f"{side}{joint}_medial" not in at and _beside(at, side, wand, joint, found[f"{side}{above}"]) is None
        ]
        if open_sides:
            missing = ", ".join(f"{side}{own} or {side}{medial}" for side in open_sides)
            without, usual = WITHOUT_PLANE_MM[joint]
            parts.append(f"no {missing}: {joint}s up to {without} mm off instead of {usual}")
    if parts:
        warn_of_file(
            path,
            "markers on thigh, shank or the inner side are missing or in line with the joints, so knees and ankles are "
            f"placed by the bend of the legs: {'; '.join(parts)} (medians of five public files)",
        )


def _middle(at: Mapping[str, Floats], one: str, other: str) -> Floats:
    return 0.5 * (at[one] + at[other]) if other in at else at[one]


USED: Mapping[str, tuple[str, ...]] = {  # markers of a joint, without side; both sides of those of the pelvis
    "Hip": ("asis",), "Knee": ("knee",), "Ankle": ("ankle",), "Shoulder": ("shoulder",), "Elbow": ("elbow",),
    "Wrist": ("wrist",), "Toe": ("toe",),
}  # fmt: skip


def _usable(name: str, known: Mapping[str, Bools]) -> Bools:
    """(n,) rows in which the markers of a joint are there."""
    if name == "Head":
        rows = [known[one] for one in known if one == "crown"] or [known[one] for one in known if "head_" in one]
    elif name[1:] == "Hip":
        back = ("Rpsis", "Lpsis") if {"Rpsis", "Lpsis"} <= set(known) else ("sacrum",)
        rows = [known[one] for one in ("Rasis", "Lasis", *back)]
    else:
        own = USED[name[1:]][0]
        rows = [known[one] for one in (f"{name[0]}{own}", f"{name[0]}{own}_medial") if one in known]
    usable: Bools = np.all(rows, axis=0)
    return usable
