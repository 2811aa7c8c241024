"""Joint centres (HALPE names, Y up) of the points of TRC and C3D files, by their names.

Points that are joint centres already, in any spelling of the side: OpenPose BODY_25, HALPE-26, COCO-17, MediaPipe's 33, the
names of Pose2Sim, those of ISB, and the centres that Plug-in Gait writes (LFEP, LFEO, LTIO, LCLO, LHUO, LRAO).
Otherwise optical markers on the skin, see `optical_markers`.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.body.inverse_kinematics import CLEAR, NEEDED
from zenocap.common.body.joint_conventions import ANSUR_MM, points_of
from zenocap.common.body.rotations import unit
from zenocap.common.errors import UserError
from zenocap.common.formats.bvh_joint_names import LEG_SHARE, y_up_matrix
from zenocap.common.formats.file_warnings import grouped_warnings, warn_of_file
from zenocap.common.formats.joint_map import UPS, JointMap, listed
from zenocap.common.formats.joint_names import plain_name
from zenocap.common.formats.optical_markers import markers_of, missing_markers, optical_centres
from zenocap.common.formats.trajectories import Trajectories

# Names of joint centres by role, without side; all of a role that are there are averaged for Toe.
CENTRES: Mapping[str, tuple[str, ...]] = {
    "Hip": ("hip", "hjc", "fep"),
    "Knee": ("knee", "kjc", "feo"),
    "Ankle": ("ankle", "ajc", "tio"),
    "Shoulder": ("shoulder", "gh", "sjc", "clo"),
    "Elbow": ("elbow", "ejc", "huo"),
    "Wrist": ("wrist", "wjc", "rao"),
}
TRUNK = {"hip": "Hip", "neck": "Neck", "head": "Head"}
TOES, EARS = ("bigtoe", "smalltoe", "footindex", "toe"), ("R.ear", "L.ear")
CROWN_OVER_EARS = (
    -next(p for p in points_of("halpe", FOURTEEN_PARTS) if p.name == "REar").offset_mm[1] / ANSUR_MM["stature"]
)
SUBJECT = re.compile(r"^.*:|\d+$")  # of names of several people: Ann:RKnee, RKnee_2
LEG_M = (0.40, 1.25)  # hip to ankle, of children too: inches read as centimetres are outside; chosen by hand
PERSON = 3  # joints, or markers, with a hip's among them, of which a person has more; chosen by hand
UPRIGHT = 0.5  # share of the largest component along the usual axis from which it counts as up; chosen by hand


def named_centres(data: Trajectories, path: Path, usual_up: int, joints: JointMap | None = None) -> Trajectories:
    """Joint centres of the points of a file, Y up.

    The twelve of `inverse_kinematics.NEEDED`; `Hip`, `Neck`, `Head` (the crown), `RToe` and `LToe` where they can be had.
    Points that have the twelve names already keep all other names.  path: for errors.  usual_up: axis, 0 to 2, that is up
    unless the posture contradicts or the map gives another.  Of several people one is taken, and left-handed axes are
    mirrored, both with a warning.  Raises UserError that lists what is missing.
    """
    if joints is not None:
        joints.check(path, data.names)
    data = _one_person(data, path, joints)
    with grouped_warnings():  # of both readings
        own = _named(data, path, joints)
        if _left_handed(own):
            text = "x is mirrored, as knees and feet point backwards: the file is left-handed, or exchanges left and right"
            warn_of_file(path, text)
            own = _named(replace(data, points=data.points * [-1.0, 1.0, 1.0]), path, joints)
        leg = _leg({name: own.points[:, k] for k, name in enumerate(own.names)})
        if leg < LEG_M[0] or leg > LEG_M[1]:
            usual = f"usual: {LEG_M[0]} to {LEG_M[1]} m: is it another unit?"
            warn_of_file(path, f"by the unit that the file states (Units, POINT:UNITS) a leg is {leg:.3g} m long; {usual}")
        return _y_up(own, path, usual_up, joints)


def _named(data: Trajectories, path: Path, joints: JointMap | None) -> Trajectories:
    """Joint centres in the file's axes."""
    if joints is None and set(NEEDED) <= set(data.names):
        spelt = {plain: name for plain, name in TRUNK.items() if name not in data.names}
        return replace(data, names=tuple(spelt.pop(plain_name(name), name) for name in data.names))
    points = {name: data.points[:, k] for k, name in enumerate(data.names)}
    found = _centres(points)
    if joints is not None:
        found |= {role: np.mean([points[name] for name in names], axis=0) for role, names in joints.joints.items()}
    if missing := [role for role in NEEDED if role not in found]:
        markers = markers_of(points)
        lacking = missing_markers(markers)
        if joints is not None or lacking:
            raise UserError(_missing(path, data.names, missing, len(markers), lacking, joints))
        found = optical_centres(markers, path)
    return Trajectories(tuple(found), data.frames, data.times_s, np.stack(list(found.values()), axis=1), data.rate)


def _left_handed(data: Trajectories) -> bool:
    """Whether knees, where they are bent, and feet point backwards, as seen from the hips.  Straight legs do not say."""
    at = {name: data.points[:, k] for k, name in enumerate(data.names)}
    left = unit(at["LHip"] - at["RHip"])
    signs = [np.zeros(0)]
    for side in "RL":
        hip, knee, ankle = (at[f"{side}{name}"] for name in ("Hip", "Knee", "Ankle"))
        hinges = [np.cross(unit(knee - hip), unit(ankle - knee))]
        if f"{side}Toe" in at:
            hinges.append(np.cross(unit(at[f"{side}Toe"] - ankle), unit(ankle - knee)))
        signs += [along[np.abs(along) > CLEAR] for along in (np.sum(hinge * left, axis=1) for hinge in hinges)]
    each = np.concatenate(signs)
    return len(each) > 0 and bool(np.median(each) < 0.0)


def _one_person(data: Trajectories, path: Path, joints: JointMap | None) -> Trajectories:
    """The points of the first person who is whole, where the names are those of several, or of the map's person."""
    mapped = {name for names in joints.joints.values() for name in names} if joints is not None else set()
    groups: dict[str, list[int]] = {}
    for k, name in enumerate(data.names):
        groups.setdefault(found[0] if (found := SUBJECT.search(name)) else "", []).append(k)
    people: dict[str, tuple[bool, list[int]]] = {}
    for subject, columns in groups.items():
        points = {data.names[k]: data.points[:, k] for k in columns}
        centres, markers = set(_centres(points)) & set(NEEDED), markers_of(points)
        hips = {"RHip", "LHip"} & centres or {"Rasis", "Lasis"} & set(markers)
        if hips and max(len(centres), len(markers)) > PERSON:
            people[subject] = len(centres) == len(NEEDED) or not missing_markers(markers), columns
    fitting = [subject for subject, (_, columns) in people.items() if mapped <= {data.names[k] for k in columns}]
    if len(people) < 2 or not fitting:
        return data
    used = next((subject for subject in fitting if people[subject][0]), fitting[0])
    columns = people[used][1]
    named = ", ".join(f"{data.names[own[0]]!r}, ..." for _, own in people.values())
    helps = "for another one: a joint map (--joints)"
    warn_of_file(path, f"{len(people)} people ({named}): that of {data.names[columns[0]]!r} is used; {helps}")
    return replace(data, names=tuple(data.names[k] for k in columns), points=data.points[:, columns])


def _centres(points: Mapping[str, Floats]) -> dict[str, Floats]:
    """Joint centres (n, 3) by role that have the name of one."""
    by_name = {plain_name(name): place for name, place in reversed(list(points.items()))}
    found: dict[str, Floats] = {}
    for letter in "RL":
        for role, stems in CENTRES.items():
            own = [by_name[f"{letter}.{stem}"] for stem in stems if f"{letter}.{stem}" in by_name]
            found |= {f"{letter}{role}": own[0]} if own else {}
        toes = [by_name[f"{letter}.{stem}"] for stem in TOES if f"{letter}.{stem}" in by_name]
        found |= {f"{letter}Toe": np.mean(toes[:2], axis=0)} if toes else {}
    found |= {name: by_name[plain] for plain, name in TRUNK.items() if plain in by_name}
    if "Head" not in found and set(EARS) <= set(by_name) and set(NEEDED) <= set(found):
        found["Head"] = _crown(found, 0.5 * (by_name[EARS[0]] + by_name[EARS[1]]))
    return found


def _crown(found: Mapping[str, Floats], ears: Floats) -> Floats:
    """(n, 3) crown above the middle of the ears (n, 3), in line with the middle of the shoulders.

    Distance: tragion to the top of the head in ANSUR II (`joint_conventions`), of a stature by the length of the legs.
    """
    line = ears - 0.5 * (found["RShoulder"] + found["LShoulder"])
    length = np.maximum(np.linalg.norm(line, axis=1, keepdims=True), 1e-9)
    crown: Floats = ears + CROWN_OVER_EARS * _leg(found) / LEG_SHARE * line / length
    return crown


def _leg(at: Mapping[str, Floats]) -> float:
    """Length of the leg, hip to ankle, metres; NaN where it is in no frame."""
    bones = ((f"{side}{a}", f"{side}{b}") for side in "RL" for a, b in (("Hip", "Knee"), ("Knee", "Ankle")))
    lengths = [np.linalg.norm(at[one] - at[other], axis=1) for one, other in bones]
    return 0.5 * sum(float(np.median(one[np.isfinite(one)])) if np.isfinite(one).any() else np.nan for one in lengths)


def _y_up(data: Trajectories, path: Path, usual_up: int, joints: JointMap | None) -> Trajectories:
    """The same in a world with Y up.  Up is from the ankles to the shoulders, if that is clear, else the usual axis."""
    at = {name: data.points[:, k] for k, name in enumerate(data.names)}
    rising = at["RShoulder"] + at["LShoulder"] - at["RAnkle"] - at["LAnkle"]
    rising = rising[np.isfinite(rising).all(axis=1)]
    up = np.median(rising, axis=0) if len(rising) else np.zeros(3)
    axis = int(np.argmax(np.abs(up)))
    if joints is not None and joints.up is not None:
        axis, down = UPS.index(joints.up), False
    elif up[usual_up] >= UPRIGHT * abs(up[axis]):
        axis, down = usual_up, False
    else:
        down = bool(up[axis] < 0.0)
        direction = f"{'-' if down else ''}{UPS[axis]}"
        warn_of_file(path, f"{direction} is taken for up, as the person stands along it; otherwise: `up` in a joint map")
    rotation = y_up_matrix(axis, down)
    return data if np.array_equal(rotation, np.eye(3)) else replace(data, points=data.points @ rotation.T)


def _missing(
    path: Path, names: Sequence[str], missing: Sequence[str], markers: int, lacking: Sequence[str], joints: JointMap | None
) -> str:
    """Error of a file without some joint centres; with few of them and many markers, of a file without some markers."""
    there = f"there are: {listed(names)}"
    if joints is None and markers > len(NEEDED) - len(missing):
        return f"{path}: no marker {', '.join(lacking)}; {there}; allowed: those, joint centres, or a joint map (--joints)"
    known = ", ".join(CENTRES[missing[0][1:]])
    allowed = f"allowed for {missing[0]}, with its side: {known}"
    helps = f"a line in {joints.path}" if joints is not None else "a joint map (--joints)"
    return f"{path}: no marker {', '.join(missing)}; {there}; {allowed}, or {helps}"
