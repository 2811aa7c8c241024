"""Point files: joint centres of a simulated movement, optical markers on its body."""

from collections.abc import Mapping
from pathlib import Path

import ezc3d
import numpy as np

from tests.common.body.test_inverse_kinematics import body
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.body.definition import Pose
from zenocap.common.body.kinematics import joint_centres, part_frames
from zenocap.common.formats.trajectories import Trajectories
from zenocap.common.formats.trc import write_trc

RATE, FRAMES = 60.0, 60
FRONT = np.array([0.0, 0.0, 1.0])
TO_Z_UP = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])


def poses() -> list[Pose]:
    """A second of knee bends with bent elbows, turning."""
    found = []
    for share in np.sin(np.linspace(0.0, np.pi, FRAMES)):
        angles = FOURTEEN_PARTS.neutral.copy()
        angles[FOURTEEN_PARTS.index["navel.y"]] = 0.6 * share
        for side in ("right", "left"):
            angles[FOURTEEN_PARTS.index[f"{side}_hip.x"]] += 0.9 * share
            angles[FOURTEEN_PARTS.index[f"{side}_knee.x"]] -= 1.4 * share
            angles[FOURTEEN_PARTS.index[f"{side}_elbow.x"]] += 0.5 + 0.6 * share
        found.append(Pose(np.array([0.2, 1.0, -0.1]), angles))
    return found


def acted_centres() -> dict[str, Floats]:
    """Joint centres (n, 3) by HALPE name, metres, Y up."""
    points = np.stack([joint_centres(FOURTEEN_PARTS, body(FOURTEEN_PARTS), pose) for pose in poses()])
    names = [marker.name for marker in FOURTEEN_PARTS.markers]
    wanted = [name for name in names if name not in ("Hip", "Neck", "RToe", "LToe")]
    return {name: points[:, names.index(name)] for name in wanted}


def write_points(path: Path, points: Mapping[str, Floats]) -> None:
    """Write points (n, 3), metres, as a .trc in metres or, by ezc3d itself, as a .c3d in millimetres."""
    names, values = tuple(points), np.stack(list(points.values()), axis=1)
    frames = np.arange(len(values), dtype=np.int64)
    if path.suffix == ".trc":
        write_trc(path, Trajectories(names, frames, frames / RATE, values, RATE))
        return
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [RATE]
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(names)
    data = np.ones((4, len(names), len(values)))
    data[:3] = np.nan_to_num(values).transpose(2, 1, 0) * 1000.0
    file["data"]["points"] = data
    file["data"]["meta_points"]["residuals"] = np.where(np.isnan(values).any(axis=2), -1.0, 0.0).T[None]
    file.write(str(path))


def optical_markers(*, medial: bool = False) -> dict[str, Floats]:
    """Markers (n, 3) on the skin of the acted body, by the names of Plug-in Gait, metres, Y up.

    Lateral markers lie beside the centres on the hinge axes, those of the pelvis where the regression of Harrington et al.
    (2007) has the hips.  medial: also on the other side of knees, ankles and elbows.
    """
    anatomy, centres = FOURTEEN_PARTS, acted_centres()
    frames = np.stack([part_frames(anatomy, body(anatomy), pose) for pose in poses()])
    axes = {part: frames[:, anatomy.index[part], :, :3] for part in anatomy.parts}
    found: dict[str, Floats] = {}
    pelvis = axes["pelvis"]
    hips = 0.5 * (centres["RHip"] + centres["LHip"])
    half = 0.5 * float(np.linalg.norm(centres["RHip"] - centres["LHip"], axis=1).mean())
    width, depth = (half - 0.0073) / 0.33, 0.15
    middle = hips + _along(pelvis, 1, 0.30 * width + 0.0109) + _along(pelvis, 2, 0.24 * depth + 0.0099)
    for side, out in (("R", -1.0), ("L", 1.0)):
        name = "right" if side == "R" else "left"
        found[f"{side}ASI"] = middle + _along(pelvis, 0, out * width / 2)
        found[f"{side}PSI"] = middle - _along(pelvis, 2, depth) + _along(pelvis, 0, out * 0.04)
        for marker, joint, part, offset in (
            ("KNE", "Knee", "upper_leg", 0.060), ("ANK", "Ankle", "lower_leg", 0.043), ("ELB", "Elbow", "upper_arm", 0.042),
        ):  # fmt: skip
            # The hinge's axis is the x axis of the part; a hanging limb is turned by half a turn about Z.
            beside = _along(axes[f"{name}_{part}"], 0, -out * offset)
            found[f"{side}{marker}"] = centres[f"{side}{joint}"] + beside
            if medial:
                found[f"{side}{ {'KNE': 'KNM', 'ANK': 'MED', 'ELB': 'ELM'}[marker] }"] = centres[f"{side}{joint}"] - beside
        found[f"{side}WRA"] = centres[f"{side}Wrist"] + [0.0, 0.0, 0.02]
        found[f"{side}WRB"] = centres[f"{side}Wrist"] - [0.0, 0.0, 0.02]
    trunk = 0.5 * (centres["RShoulder"] + centres["LShoulder"]) - hips
    up = trunk / np.linalg.norm(trunk, axis=1, keepdims=True)
    across = np.linalg.norm(centres["RShoulder"] - centres["LShoulder"], axis=1, keepdims=True)
    for side in "RL":
        found[f"{side}SHO"] = centres[f"{side}Shoulder"] + 0.17 * across * up
    return found


def _along(axes: Floats, axis: int, length: float) -> Floats:
    along: Floats = length * axes[:, :, axis]
    return along
