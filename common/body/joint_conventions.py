"""Joint conventions of exports: which points they have, and where each lies on the body.

`zenocap` is the markers of the anatomy.  The other conventions are joint centres of the body plus published offsets in
segment axes (X front, Y up, Z right, see `clinical_angles`), as shares of a length of the body.
SPINE can be added to each.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal, get_args

from zenocap.common.body.anatomy import FOURTEEN_PARTS, Anatomy

Convention = Literal["zenocap", "isb", "coco", "halpe"]
Origin = Literal["measured", "share", "derived"]
CONVENTIONS: tuple[Convention, ...] = get_args(Convention)
TITLES: Mapping[Convention, str] = {"zenocap": "zenocap", "isb": "ISB", "coco": "COCO-17", "halpe": "HALPE-26"}

# Lengths of the bodies that the offsets below are measured on, mm.
# Pose2Sim: its OpenSim model, joint centres with all coordinates 0.  Stature: Head marker above the bones of the sole.
POSE2SIM_MM: Mapping[str, float] = {
    "stature": 1704.7, "hip_half": 83.5, "shoulder_half": 170.0, "upper_arm": 286.8, "thigh": 408.1, "shank": 419.5,
    # Bones of the foot 265.5, times the foot of the average body, 0.130 statures, over that of ANSUR II, 0.1528 statures.
    "foot": 225.9,
}  # fmt: skip
ANSUR_MM: Mapping[str, float] = {"stature": 1000.0}  # means of the shares of stature, both sexes with equal weight

ANKLE_HEIGHT = 0.039  # in statures, as in `anatomy`
# Elbow to wrist over elbow to fingertip; joint centres, mean of both sexes, de Leva (1996), as in `proportions`.
WRIST_SHARE = 266.6 / (266.6 + 180.0)


LIMB_POINTS = {  # names without the letter of the side, of all conventions
    "arm": ("Elbow", "Wrist", "EJC", "WJC"),
    "leg": ("Knee", "Ankle", "KJC", "AJC", "BigToe", "SmallToe", "Heel"),
}


@dataclass(frozen=True)
class Point:
    """A point of a convention: the mean of the bases plus an offset.

    bases: markers of the anatomy, or `RWristCentre`, `RSole` and left, `Waist`, `HeadJoint` (see `keypoints`).  part: whose
    segment axes the offset has.  offset_mm: front, up, right, on a body whose `scale` is reference_mm long.
    """

    name: str
    bases: tuple[str, ...]
    part: str = ""
    offset_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    scale: str = "stature"
    reference_mm: float = 1.0


def _pose2sim(name: str, bases: str, part: str, front: float, up: float, right: float, scale: str) -> Point:
    return Point(name, tuple(bases.split()), part, (front, up, right), scale, POSE2SIM_MM[scale])


# Right side and middle.  Pose2Sim (BSD-3-Clause), commit f7b39c7 of 2026-08-18: places of the key points on its OpenSim
# model in Markers_Halpe26.xml, of the eyes in Markers_Coco133.xml, less the model's joint centres.  Markers_Coco17.xml has
# the same shoulders, elbows, wrists, knees and ankles.  Across the arm, offsets of 9 to 12 mm are left out: its axial
# rotation is not measured.  The wrist's remaining one is below 1 mm.
_HIP = _pose2sim("RHip", "RHip", "pelvis", 6.8, -15.2, 21.9, "hip_half")
_KNEE = _pose2sim("RKnee", "RKnee", "right_upper_leg", 2.7, 10.1, 3.3, "thigh")
# From the sole, 76.0 mm, less 0.039 statures: the model's joint is 14 mm nearer to the sole than ours.
_ANKLE = _pose2sim("RAnkle", "RAnkle", "right_lower_leg", -0.3, 9.5, 15.0, "shank")
_SHOULDER = _pose2sim("RShoulder", "RShoulder", "chest", -16.0, -5.2, 31.6, "shoulder_half")
_ELBOW = _pose2sim("RElbow", "RElbow", "right_upper_arm", 0.0, -11.7, 0.0, "upper_arm")
_WRIST = Point("RWrist", ("RWristCentre",))
_PELVIS = _pose2sim("Hip", "RHip LHip", "pelvis", 6.8, -15.2, 0.0, "hip_half")
_NECK = _pose2sim("Neck", "RShoulder LShoulder", "chest", -4.0, 75.4, 0.0, "stature")
# From the vertex above the middle of the model's skull, which is 5.6 mm in front of the origin of its head.
_HEAD = _pose2sim("Head", "Head", "head", 10.3, 0.0, 0.0, "stature")
_NOSE = _pose2sim("Nose", "Head", "head", 110.7, -151.5, 0.0, "stature")
_EYE = _pose2sim("REye", "Head", "head", 72.5, -117.3, 31.1, "stature")
# ANSUR II (Gordon et al. 2014), means of the individual data: tragion to top of head 0.0763 and bizygomatic breadth 0.0818
# statures.  The survey has no distance to the front; here below the vertex.
_EAR = Point("REar", ("Head",), "head", (0.0, -76.3, 40.9), "stature", ANSUR_MM["stature"])
# From the sole below the ankle.
_BIG_TOE = _pose2sim("RBigToe", "RSole", "right_foot", 194.7, 20.0, -5.5, "foot")
_SMALL_TOE = _pose2sim("RSmallToe", "RSole", "right_foot", 157.1, 19.7, 37.8, "foot")
_HEEL = _pose2sim("RHeel", "RSole", "right_foot", -35.2, 35.4, 6.1, "foot")

# Wu et al. (2002, 2005), cited from memory: centre of the femoral head, middle of the femoral epicondyles, of the malleoli,
# glenohumeral rotation centre (GH), middle of the humeral epicondyles, of the styloids.  The fitted body has joint centres
# there, and the wrist at de Leva's share.
_ISB = tuple(
    Point(f"R{name}", (f"R{base}",))
    for name, base in (
        ("HJC", "Hip"), ("KJC", "Knee"), ("AJC", "Ankle"), ("GH", "Shoulder"), ("EJC", "Elbow"), ("WJC", "WristCentre"),
    )
)  # fmt: skip


def _left(point: Point) -> Point:
    """The same point of the left side."""
    front, up, right = point.offset_mm
    return replace(
        point,
        name="L" + point.name[1:],
        bases=tuple(base if base == "Head" else "L" + base[1:] for base in point.bases),
        part=point.part.replace("right_", "left_"),
        offset_mm=(front, up, -right),
    )


def _both(*points: Point) -> tuple[Point, ...]:
    """The points of the right side, then of the left."""
    return *points, *map(_left, points)


# Order: the skeletons of Pose2Sim, from which it writes TRC files; eyes and ears, which these omit, at the end.
_LEG, _ARM, _FACE = (_HIP, _KNEE, _ANKLE), (_SHOULDER, _ELBOW, _WRIST), (_EYE, _EAR)
_POINTS: Mapping[Convention, tuple[Point, ...]] = {
    "isb": _both(*_ISB),
    "coco": (*_both(*_LEG), _NOSE, *_both(*_ARM), *_both(*_FACE)),
    "halpe": (
        _PELVIS, *_both(*_LEG, _BIG_TOE, _SMALL_TOE, _HEEL), _NECK, _HEAD, _NOSE, *_both(*_ARM),
        *_both(*_FACE),
    ),
}  # fmt: skip

# The model's own joints from pelvis to head.  No convention above has names for them: COCO-17 has no point of the trunk's
# middle, HALPE-26 has Hip and Neck.  The ISB's LJC and CJC (L5/S1, C7/T1) are vertebrae, which silhouettes do not show.
# Names of those that have such points: Spine of Human3.6M; Pelvis, Thorax and UpperNeck of MPII.
WAIST = "waist"  # joint between pelvis and chest
SPINE = (
    Point("Pelvis", ("RHip", "LHip")),
    Point("Spine", ("Waist",)),
    Point("Thorax", ("RShoulder", "LShoulder")),
    Point("UpperNeck", ("HeadJoint",)),
)


def points_of(convention: Convention, anatomy: Anatomy, *, spine: bool = False) -> tuple[Point, ...]:
    """Points of a convention on an anatomy, in the order of files; those on parts that it lacks are left out.

    spine: with the points of SPINE at the end.
    """
    if convention == "zenocap":
        found = tuple(Point(marker.name, (marker.name,)) for marker in anatomy.markers)
    else:
        parts = (replace(point, part=_part_of(point.part, anatomy)) for point in _POINTS[convention])
        found = tuple(point for point in parts if not point.part or point.part in anatomy.parts)
    if not spine:
        return found
    bends = WAIST in anatomy.index  # else the head's joint is on the line of the shoulders
    return found + tuple(point for point in SPINE if bends or not {"Waist", "HeadJoint"} & set(point.bases))


def limb_of(name: str) -> str | None:
    """Limb of a point beyond shoulder or hip, such as `right_arm`, by its name in any convention; None for the others."""
    side = {"R": "right", "L": "left"}.get(name[:1])
    part = next((part for part, names in LIMB_POINTS.items() if name[1:] in names), None)
    return f"{side}_{part}" if side and part else None


def left_out(convention: Convention, anatomy: Anatomy, *, spine: bool = False) -> tuple[str, ...]:
    """Names of the points of a convention that an anatomy cannot give.  spine: see `points_of`."""
    available = {point.name for point in points_of(convention, anatomy, spine=spine)}
    return tuple(p.name for p in points_of(convention, FOURTEEN_PARTS, spine=spine) if p.name not in available)


def origin_of(point: Point, anatomy: Anatomy) -> Origin:
    """Origin of a point.

    `measured`: joint, or end of a segment, of the fitted body.  `share`: on a measured segment, at an anthropometric
    share of its length.  `derived`: beside the fitted body, by a published offset.
    """
    if any(point.offset_mm):
        return "derived"
    # The bend of the spine is at a share of the length from hips to shoulders, which is measured.
    shares = {marker.name for marker in anatomy.markers if 0.0 < marker.along < 1.0} | {"Waist"}
    return "share" if any(base in shares or base.endswith("WristCentre") for base in point.bases) else "measured"


def _part_of(part: str, anatomy: Anatomy) -> str:
    """The same part in an anatomy, whose torso is pelvis and chest if it has none of them."""
    return "torso" if part in ("pelvis", "chest") and part not in anatomy.parts else part
