"""Joint centres in the convention of the shared clips' truth: the joints of the MakeHuman base mesh.

The truth of the rendered clips has the centres of the mesh's joint markers, whose limbs are scaled for each person.
Where a limb bends, hence at knees, elbows and shoulders, the images determine the joint, and both conventions mean the
same point.  Hips, top of the head, ankles and wrists are defined otherwise; their offsets below are read from the mesh,
which is published, and not from the clips.
"""

from dataclasses import replace

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.joint_conventions import ANKLE_HEIGHT
from zenocap.common.body.rotations import perpendicular, unit
from zenocap.common.formats.trajectories import Trajectories

# MakeHuman (CC0), data/3dobjs/base.obj: `joint-l-upper-leg` and others are the means of their vertices; the stature is the
# height of the group `body`, 16.659 units.
HIP_HALF = 0.06625 / 0.2857  # hips beside the middle, over the height of the shoulders above the hips
# `joint-head-2`, up and front, in statures: below the highest vertex, and behind the middle of the skull, which is 0.0343
# in front of the origin at the height 0.95.
HEAD = (0.9948 - 1.0, 0.0049 - 0.0343)
ANKLE = 0.0432 - ANKLE_HEIGHT  # `joint-l-ankle` above the sole, less that of our body, in statures
# Elbow to `joint-l-hand` 0.1359, and from there to the fingertip (`joint-l-finger-3-4`) 0.1068 statures: the wrist's share
# of the lower arm, over that of our wrist (see `anatomy`), less 1.
WRIST = (0.1359 / (0.1359 + 0.1068)) / (0.146 / (0.146 + 0.108)) - 1.0


def in_mesh_convention(track: Trajectories) -> Trajectories:
    """The track with hips, head, ankles and wrists where the mesh has them; needs the joint centres of `zenocap`."""
    at = {name: track.points[:, k] for k, name in enumerate(track.names)}
    trunk = np.linalg.norm(at["Neck"] - at["Hip"], axis=1, keepdims=True)
    leg = sum(_length(at, f"{s}Hip", f"{s}Knee") + _length(at, f"{s}Knee", f"{s}Ankle") for s in "RL") / 2
    stature = (leg + trunk + _length(at, "Neck", "Head")) / (1.0 - ANKLE_HEIGHT)
    moved = dict(at)
    left = unit(at["LHip"] - at["RHip"])
    moved |= {"LHip": at["Hip"] + HIP_HALF * trunk * left, "RHip": at["Hip"] - HIP_HALF * trunk * left}
    up = unit(at["Head"] - at["Neck"])
    front = np.cross(unit(perpendicular(at["LShoulder"] - at["RShoulder"], up)), up)
    moved["Head"] = at["Head"] + stature * (HEAD[0] * up + HEAD[1] * front)
    for side in "RL":
        knee, ankle, elbow, wrist = (f"{side}{name}" for name in ("Knee", "Ankle", "Elbow", "Wrist"))
        moved[ankle] = at[ankle] + ANKLE * stature * unit(at[knee] - at[ankle])
        moved[wrist] = at[wrist] + WRIST * (at[wrist] - at[elbow])
    return replace(track, points=np.stack([moved[name] for name in track.names], axis=1))


def _length(at: dict[str, Floats], first: str, second: str) -> Floats:
    """(n, 1) distance between two joints, metres."""
    return np.asarray(np.linalg.norm(at[first] - at[second], axis=1, keepdims=True))
