"""OpenSim's generalized coordinates as joint rotations, and back.

Names and rotation orders are those of the models gait2392, Rajagopal 2015 and Pose2Sim: hip_flexion, hip_adduction,
hip_rotation about Z, X, Y of frames with X to the front, Y up and Z to the right, with X and Y reversed on the left side.
Likewise arm_flex, arm_add, arm_rot, lumbar and neck joints.  Knee, ankle and elbow are hinges about Z here; the
models' axes are oblique by a few degrees.  The signs were checked against triangulated key points of the clip real_beam4.
Of equal angles those inside the ranges of Rajagopal 2016 are written, to which OpenSim clamps a coordinate.
"""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.clinical_angles import JOINT_AXES, SIDES, JointRotations, joint_rotations
from zenocap.common.body.rotations import euler_to_matrix
from zenocap.common.errors import FileNote, UserError
from zenocap.common.formats.euler_solutions import FREE, TURN, UPRIGHT, continuous_euler
from zenocap.common.formats.export_format import ExportRequest
from zenocap.common.formats.mot import Mot, write_mot
from zenocap.common.formats.pose_track import PoseTrack
from zenocap.common.formats.trajectories import MATRICES, Axes, convert

FRAMES: tuple[Axes, ...] = ("y-up", "opensim")  # axes with Y up, as OpenSim's ground
VERTEBRAE = ("L5_S1", "L4_L5", "L3_L4", "L2_L3", "L1_L2", "L1_T12")
# Knees below this that never flex as much the other way: the model counts flexion negative (gait2392).  Chosen by hand,
# beyond any hyperextension.
NEGATIVE_KNEE_DEG = -20.0
# Of a hip or an arm beyond its range: least angle, and share of the rows, that give a note.  By hand: a T-pose is short.
BEYOND_DEG, LONG = 10.0, 0.05
MANY, TURNS = 8, 4.0  # angles of limbs that do not all stay below 3.1 degrees; turns that none reaches.  Chosen by hand.
# Degrees; Rajagopal2016.osim of opensim-org/opensim-models, where all are clamped.  pelvis_rotation is free: a person turns
# farther than its range, and the other solution lies upside down.
HIP_DEG = ((-30.0, 120.0), (-50.0, 30.0), (-40.0, 40.0))
ARM_DEG = ((-90.0, 90.0), (-120.0, 90.0), (-90.0, 90.0))
PELVIS_DEG = ((-90.0, 90.0), (-90.0, 90.0), FREE)
ROOT_ENDS = {  # there, of the coordinates that a person leaves by walking or turning
    "pelvis_rotation": (-90, 90, "degrees"), "pelvis_tx": (-5, 5, "m"), "pelvis_ty": (-1, 2, "m"),
    "pelvis_tz": (-3, 3, "m"),
}  # fmt: skip
ROOT_BEYOND = {"degrees": 1.0, "m": 0.01}  # of the root beyond its range, from which there is a note; chosen by hand


@dataclass(frozen=True)
class CoordinateTriple:
    """Coordinates about Z, X and Y of one joint, or about Z only.  signs: of the rotations about the axes.

    ranges_deg: of the coordinates.
    """

    names: tuple[str, ...]
    signs: tuple[float, ...] = (1.0, 1.0, 1.0)
    ranges_deg: tuple[tuple[float, float], ...] = ((-90.0, 90.0),) * 3

    @property
    def axes(self) -> str:
        """Rotation axes, outermost first."""
        return JOINT_AXES[: len(self.names)]

    @property
    def ranges(self) -> list[tuple[float, float]]:
        """Of the rotations about the three axes, radians; those of a left side are reversed."""
        ends = [np.sort(sign * np.radians(ends)) for sign, ends in zip(self.signs, self.ranges_deg, strict=False)]
        return [(float(low), float(high)) for low, high in ends] + [UPRIGHT, UPRIGHT][: 3 - len(ends)]


def _limbs(side: str, letter: str, out: float) -> dict[str, tuple[CoordinateTriple, ...]]:
    """Joints of one side.  out: 1 for the right, -1 for the left."""
    signs = (1.0, out, out)
    hip = tuple(f"hip_{name}_{letter}" for name in ("flexion", "adduction", "rotation"))
    arm = tuple(f"arm_{name}_{letter}" for name in ("flex", "add", "rot"))
    return {
        f"{side}_hip": (CoordinateTriple(hip, signs, HIP_DEG),),
        f"{side}_knee": (CoordinateTriple((f"knee_angle_{letter}",), (-1.0,)),),
        f"{side}_ankle": (CoordinateTriple((f"ankle_angle_{letter}",), (1.0,)),),
        f"{side}_shoulder": (CoordinateTriple(arm, signs, ARM_DEG),),
        f"{side}_elbow": (CoordinateTriple((f"elbow_flex_{letter}",), (1.0,)),),
    }


PELVIS = CoordinateTriple(("pelvis_tilt", "pelvis_list", "pelvis_rotation"), ranges_deg=PELVIS_DEG)
POSITION = ("pelvis_tx", "pelvis_ty", "pelvis_tz")
LUMBAR = CoordinateTriple(("lumbar_extension", "lumbar_bending", "lumbar_rotation"))
SPINE = tuple(CoordinateTriple((f"{name}_Flex_Ext", f"{name}_Lat_Bending", f"{name}_axial_rotation")) for name in VERTEBRAE)
NECK = CoordinateTriple(("neck_flexion", "neck_bending", "neck_rotation"))
# By joint: alternatives, each a chain of triples from the proximal to the distal segment.
JOINTS: Mapping[str, tuple[tuple[CoordinateTriple, ...], ...]] = {
    "pelvis": ((PELVIS,),),
    "trunk": ((LUMBAR,), SPINE),
    "neck": ((NECK,),),
} | {joint: (chain,) for side in SIDES for joint, chain in _limbs(*side).items()}


def rotations_of(mot: Mot, path: Path) -> tuple[dict[str, Floats], tuple[str, ...]]:
    """Joint rotations (n, 3, 3) of the known coordinates, and notes about assumptions.

    A joint needs its first coordinate, about Z; missing ones about X and Y are 0.  path: for errors.  Raises UserError
    when no coordinate is known.
    """
    rotations: dict[str, Floats] = {}
    mot, notes = _in_its_unit(mot, path)
    for joint, alternatives in JOINTS.items():
        chain = next((chain for chain in alternatives if all(triple.names[0] in mot.columns for triple in chain)), None)
        if chain is None:
            continue
        if missing := [name for triple in chain for name in triple.names if name not in mot.columns]:
            notes.append(f"no {', '.join(missing)} in {path.name}: taken as 0")
        rotation: Floats = np.broadcast_to(np.eye(3), (len(mot.times_s), 3, 3))
        for triple in chain:
            rotation = rotation @ _rotation(mot, triple)
        if joint.endswith("_knee") and _flexion_is_negative(mot):
            rotation = np.swapaxes(rotation, 1, 2)
        rotations[joint] = rotation
    if not rotations:
        allowed = [alternatives[0][0].names[0] for alternatives in JOINTS.values()]
        columns = ", ".join(mot.columns)[:200]
        raise UserError(f"{path}: no known coordinate: {columns}: allowed: one or more of {', '.join(allowed)}")
    if _flexion_is_negative(mot):
        notes.append(f"knee_angle is negative in flexion in {path.name}, as in gait2392: its sign is reversed")
    if "pelvis" in rotations and "trunk" in rotations:
        rotations["trunk_inclination"] = rotations["pelvis"] @ rotations["trunk"]
    return rotations, tuple(notes)


def coordinates_of(track: PoseTrack, axes: Axes = "opensim") -> tuple[Floats, dict[str, Floats]]:
    """Times (m,) in seconds and coordinates by name, (m,) degrees and metres, of the m rows with a pose.

    axes: of the ground, one of FRAMES.  pelvis_tx ... is midway between the hips.  The trunk of ten parts is the pelvis,
    with a lumbar joint at 0; there are no ankles then.  Raises ValueError for other axes.
    """
    if axes not in FRAMES:
        raise ValueError(f"axes {axes!r}: allowed: {', '.join(FRAMES)}")
    rows = np.flatnonzero(track.known)
    rotations: JointRotations = joint_rotations(track.anatomy, track.angles[rows])
    found = dict(rotations)
    found.setdefault("pelvis", found["trunk_inclination"])
    found.setdefault("trunk", np.tile(np.eye(3), (len(rows), 1, 1)))
    found["pelvis"] = MATRICES[axes] @ MATRICES["opensim"].T @ found["pelvis"]
    centres = track.trajectories()
    hips = convert(centres.points[rows, centres.names.index("Hip")], axes)
    columns: dict[str, Floats] = {}
    for joint, alternatives in JOINTS.items():
        if joint in found:
            (triple,) = alternatives[0]
            columns |= _coordinates(triple, found[joint], track.step_s)
        if joint == "pelvis":
            columns |= {name: hips[:, k] for k, name in enumerate(POSITION)}
    return track.times_s[rows], columns


def warn_of_ranges(take: str, columns: Mapping[str, Floats]) -> None:
    """Give a note where the root, or hips and arms for long, are beyond the ranges to which OpenSim clamps."""
    found = []
    for name, (low, high, unit) in ROOT_ENDS.items():
        lowest, highest = float(columns[name].min()), float(columns[name].max())
        if lowest < low - ROOT_BEYOND[unit] or highest > high + ROOT_BEYOND[unit]:
            found.append(f"{name} from {lowest:.4g} to {highest:.4g} {unit} ({low} to {high})")
    for triple in (JOINTS[f"{side}_{joint}"][0][0] for side, *_ in SIDES for joint in ("hip", "shoulder")):
        for name, (lower, upper) in zip(triple.names, triple.ranges_deg, strict=True):
            share = float(np.mean((columns[name] < lower - BEYOND_DEG) | (columns[name] > upper + BEYOND_DEG)))
            if share >= LONG:
                found.append(f"{name} in {share:.0%} of the rows")
    if found:
        text = "beyond the ranges of Rajagopal's models, to which OpenSim clamps them"
        warnings.warn(f"{take}: {text}: {', '.join(found)}: set their `clamped` to false", FileNote, stacklevel=2)


def _in_its_unit(mot: Mot, path: Path) -> tuple[Mot, list[str]]:
    """The file in degrees where most limbs turn by more than a full turn of radians, and notes, also on small degrees."""
    limbs = [name for joint, rows in JOINTS.items() if joint != "pelvis" for triple in rows[0] for name in triple.names]
    found = [float(np.abs(np.nan_to_num(mot.columns[name])).max()) for name in limbs if name in mot.columns]
    if not mot.in_degrees and found and (np.median(found) > TURN or max(found) > TURNS * TURN):
        return replace(mot, in_degrees=True), [f"inDegrees = no in {path.name}, but angles of {max(found):.0f}: degrees"]
    if mot.in_degrees and len(found) >= MANY and 0.0 < max(found) < TURN / 2:
        return mot, [f"inDegrees = yes in {path.name}, but no angle beyond {max(found):.2f}: are they radians?"]
    return mot, []


def _rotation(mot: Mot, triple: CoordinateTriple) -> Floats:
    zero = np.zeros(len(mot.times_s))
    turns = np.stack([sign * mot.columns.get(one, zero) for one, sign in zip(triple.names, triple.signs, strict=True)], 1)
    return euler_to_matrix(triple.axes, np.radians(turns) if mot.in_degrees else turns)


def _coordinates(triple: CoordinateTriple, rotations: Floats, step_s: float) -> dict[str, Floats]:
    """Coordinates in degrees, continuous over the rows."""
    angles = np.degrees(continuous_euler(JOINT_AXES, rotations, triple.ranges, step_s))
    return {name: sign * angles[:, k] for k, (name, sign) in enumerate(zip(triple.names, triple.signs, strict=True))}


def _flexion_is_negative(mot: Mot) -> bool:
    knees = [mot.columns[name] for name in ("knee_angle_r", "knee_angle_l") if name in mot.columns]
    if not knees:
        return False
    values = np.concatenate(knees) if mot.in_degrees else np.degrees(np.concatenate(knees))
    return bool(values.min() < NEGATIVE_KNEE_DEG and values.max() < -NEGATIVE_KNEE_DEG)


def export_mot(path: Path, request: ExportRequest) -> None:
    """For `zenocap export`.  Raises UserError without a tracked pose."""
    if not request.track.known.any():
        raise UserError(f"{path}: the person is lost in every frame: no row to write")
    notes = [] if request.smoothing == "none" else [f"Smoothing: {request.smoothing}.", ""]
    notes += [] if request.measured else [f"Body: {request.sizes}.", ""]
    times_s, columns = coordinates_of(request.track, request.axes)
    warn_of_ranges(request.take, columns)
    write_mot(path, times_s, columns, notes)
