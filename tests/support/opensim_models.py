"""Small generic model of OpenSim 4 with the names of Rajagopal's, and what OpenSim plays with it."""

from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from zenocap.common.arrays import Floats
from zenocap.common.formats.mot import read_mot
from zenocap.common.formats.opensim_coordinates import JOINTS, CoordinateTriple

Turns = Mapping[str, CoordinateTriple]
OF_LIMBS: Turns = {  # by the names of the model's joints
    f"{joint}_{side[0]}": JOINTS[f"{side}_{name}"][0][0]
    for side in ("right", "left")
    for joint, name in (("acromial", "shoulder"), ("elbow", "elbow"), ("knee", "knee"))
}
AXES = ((0, 0, 1), (1, 0, 0), (0, 1, 0))  # of the coordinates of a joint, outermost first
# Joint, child, parent, place in the parent on the right side (m), kind.
TRUNK = (
    ("ground_pelvis", "pelvis", "ground", (0, 0, 0), "FreeJoint"),
    ("back", "torso", "pelvis", (-0.1, 0.08, 0), "BallJoint"),
)
SIDE = (
    ("hip", "femur", "pelvis", (-0.056, -0.078, 0.077), "BallJoint"),
    ("knee", "tibia", "femur", (0, -0.41, 0), "PinJoint"),
    ("ankle", "talus", "tibia", (0, -0.42, 0), "PinJoint"),
    ("subtalar", "calcn", "talus", (-0.049, -0.042, 0.008), "WeldJoint"),
    ("mtp", "toes", "calcn", (0.179, -0.002, 0.001), "WeldJoint"),
)
ARM = (
    ("acromial", "humerus", "torso", (0, 0.37, 0.17), "BallJoint"),
    ("elbow", "ulna", "humerus", (0, -0.29, 0), "PinJoint"),
    ("wrist", "hand", "ulna", (0, -0.25, 0), "WeldJoint"),
)
needs_opensim = pytest.mark.skipif(find_spec("opensim") is None, reason="opensim is not installed: pip install opensim")
# As Rajagopal's model has one at each knee cap: without a constraint `Model.assemble` does nothing.
COUPLER = (
    '<ConstraintSet><objects><CoordinateCouplerConstraint name="coupler"><coupled_coordinates_function>'
    "<LinearFunction><coefficients>1 0</coefficients></LinearFunction></coupled_coordinates_function>"
    "<independent_coordinate_names>knee_angle_r</independent_coordinate_names>"
    "<dependent_coordinate_name>knee_angle_l</dependent_coordinate_name></CoordinateCouplerConstraint></objects>"
    "</ConstraintSet>"
)


def write_model(path: Path, *, arms: bool = True, version: int = 40000, turns: Turns | None = None) -> Path:
    """Write the model, of which arms can be left out.

    turns: by joint, its coordinates, which are clamped to their ranges.
    """
    rows = list(TRUNK)
    for ending, out in (("_r", 1), ("_l", -1)):
        for joint, child, parent, (x, y, z), kind in (*SIDE, *(ARM if arms else ())):
            name = parent if parent in ("pelvis", "torso") else parent + ending
            rows.append((joint + ending, child + ending, name, (x, y, out * z), kind))
    bodies = "".join(
        f'<Body name="{child}"><mass>1</mass><mass_center>0 0 0</mass_center><inertia>0.1 0.1 0.1 0 0 0</inertia></Body>'
        for _, child, *_ in rows
    )
    joints = "".join(_joint(*row, (turns or {}).get(row[0])) for row in rows)
    path.write_text(
        f'<?xml version="1.0" encoding="UTF-8"?><OpenSimDocument Version="{version}"><Model name="small">'
        f'<BodySet name="bodyset"><objects>{bodies}</objects></BodySet>'
        f'<JointSet name="jointset"><objects>{joints}</objects></JointSet>'
        f"{COUPLER if turns else ''}</Model></OpenSimDocument>\n",
        encoding="utf-8",
    )
    return path


def _joint(
    name: str, child: str, parent: str, place: tuple[float, float, float], kind: str, turn: CoordinateTriple | None
) -> str:
    where = "/ground" if parent == "ground" else f"/bodyset/{parent}"
    own, kind = ("", kind) if turn is None else (_coordinates(turn), "CustomJoint")
    return (
        f'<{kind} name="{name}"><socket_parent_frame>parent_offset</socket_parent_frame>'
        f"<socket_child_frame>child_offset</socket_child_frame>{own}<frames>"
        f'<PhysicalOffsetFrame name="parent_offset"><socket_parent>{where}</socket_parent>'
        f"<translation>{place[0]} {place[1]} {place[2]}</translation></PhysicalOffsetFrame>"
        f'<PhysicalOffsetFrame name="child_offset"><socket_parent>/bodyset/{child}</socket_parent>'
        f"<translation>0 0 0</translation></PhysicalOffsetFrame></frames></{kind}>"
    )


def _coordinates(turn: CoordinateTriple) -> str:
    """Coordinates of a joint, clamped to their ranges, and its rotations about Z, X and Y by them."""
    coordinates, axes = "", ""
    for k, axis in enumerate(AXES):
        axes += f'<TransformAxis name="rotation{k + 1}"><axis>{" ".join(str(a) for a in axis)}</axis>'
        if k < len(turn.names):
            name, (low, high) = turn.names[k], np.radians(turn.ranges_deg[k])
            coordinates += f'<Coordinate name="{name}"><range>{low} {high}</range><clamped>true</clamped></Coordinate>'
            axes += f"<coordinates>{name}</coordinates><LinearFunction><coefficients>{turn.signs[k]} 0"
            axes += "</coefficients></LinearFunction></TransformAxis>"
        else:
            axes += "<Constant><value>0</value></Constant></TransformAxis>"
    return f"<coordinates>{coordinates}</coordinates><SpatialTransform>{axes}</SpatialTransform>"


def hands_off(mot: Path, folder: Path) -> Floats:
    """Distance (n, 2) in metres of the right and the left hand, seen from the trunk, from where the angles have them.

    Of an OpenSim that plays the file with the ranges of the model of `OF_LIMBS`, which is written to the folder.
    """
    import opensim

    opensim.Logger.setLevelString("Error")
    opensim.Logger.removeFileSink()
    model = opensim.Model(str(write_model(folder / "limbs.osim", turns=OF_LIMBS)))
    state, motion, coordinates, bodies = model.initSystem(), read_mot(mot), model.getCoordinateSet(), model.getBodySet()

    def hands() -> Floats:
        model.realizePosition(state)
        places = [bodies.get(f"hand_{s}").findStationLocationInAnotherFrame(state, zero, bodies.get("torso")) for s in "rl"]
        return np.array([[place.get(k) for k in range(3)] for place in places])

    zero, found = opensim.Vec3(0), []
    for row in range(len(motion.times_s)):
        for name, values in motion.columns.items():
            if coordinates.contains(name):
                coordinates.get(name).setValue(state, float(np.radians(values[row])), False)
        as_written = hands()
        model.assemble(state)
        found.append(np.linalg.norm(hands() - as_written, axis=1))
    return np.array(found)
