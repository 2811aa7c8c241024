"""Roles of joints by the structure of a skeleton whose names say nothing, or only the side."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.common.formats.test_bvh_joint_names import standing
from tests.support.places import MOTIONS
from zenocap.common.body.rotations import euler_to_matrix
from zenocap.common.errors import UserError
from zenocap.common.formats.bvh_joint_names import centres_of, joint_roles, roles_of
from zenocap.common.formats.bvh_reader import END, Bvh, read_bvh
from zenocap.common.formats.bvh_structure import StructureError, roles_by_structure, side_of
from zenocap.common.formats.bvh_tree import Tree
from zenocap.common.formats.bvh_writer import write_bvh

Bone = tuple[str, str, tuple[float, float, float]]  # name, parent, offset in metres: X left, Y up, Z forward


def chain(parent: str, *bones: tuple[str, tuple[float, float, float]]) -> list[Bone]:
    """Bones one after another."""
    above = [parent, *(name for name, _ in bones)]
    return [(name, before, offset) for before, (name, offset) in zip(above, bones, strict=False)]


def arm(side: str, out: float, *, twist: bool, fingers: bool) -> list[Bone]:
    half, whole = (0.15 * out, 0.0, 0.0), (0.30 * out, 0.0, 0.0)
    upper = [("Twist", half), ("Elbow", half)] if twist else [("Elbow", whole)]
    bones = [("Clavicle", (0.04 * out, 0.12, 0.0)), ("Shoulder", (0.14 * out, 0.0, 0.0)), *upper]
    bones += [("Wrist", (0.25 * out, 0.0, 0.0)), *([] if fingers else [(f"Wrist{END}", (0.08 * out, 0.0, 0.0))])]
    found = chain("Chest", *((side + name, offset) for name, offset in bones))
    for k in range(5 if fingers else 0):
        finger = ((f"{side}F{k}a", (0.09 * out, 0.0, 0.02 * k - 0.04)), (f"{side}F{k}b", (0.05 * out, 0.0, 0.0)))
        found += chain(f"{side}Wrist", *finger)
    return found


def leg(side: str, out: float, *, socket: bool, toes: bool) -> list[Bone]:
    bones = [("Socket", (0.0, 0.0, 0.0))] if socket else []
    bones += [("Hip", (0.09 * out, -0.05, 0.0)), ("Knee", (0.0, -0.43, 0.0)), ("Ankle", (0.0, -0.41, 0.0))]
    bones += [("Toe", (0.0, -0.06, 0.13)), *([(f"Toe{END}", (0.0, 0.0, 0.06))] if toes else [])]
    return chain("Hips", *((side + name, offset) for name, offset in bones))


def skeleton(*, twist=False, fingers=False, socket=False, toes=True, face=False, seed=0) -> Bvh:
    """A person who moves all joints a little.  twist: a joint in line in the upper arms.  socket: one before each hip."""
    heights = {"Root": 0.0, "Hips": 0.95, "Spine": 0.12, "Chest": 0.25}
    bones = chain("", *((name, (0.0, height, 0.0)) for name, height in heights.items()))
    for side, out in (("L", 1.0), ("R", -1.0)):
        bones += leg(side, out, socket=socket, toes=toes) + arm(side, out, twist=twist, fingers=fingers)
    bones += chain("Chest", ("Neck", (0.0, 0.2, 0.0)), ("Head", (0.0, 0.1, 0.02)))
    if face:
        bones += [("Face", "Head", (0.0, 0.0, 0.01)), ("Jaw", "Face", (0.0, -0.02, 0.06))]
        bones += [("EyeL", "Face", (0.03, 0.06, 0.08)), ("EyeR", "Face", (-0.03, 0.06, 0.08))]
    else:
        bones.append((f"Head{END}", "Head", (0.0, 0.18, 0.0)))
    names = [name for name, _, _ in bones]
    parents = tuple(names.index(parent) if parent else -1 for _, parent, _ in bones)
    rng, count = np.random.default_rng(seed), 30
    points, rotations = np.zeros((count, len(bones), 3)), np.zeros((count, len(bones), 3, 3))
    for k, (name, _, offset) in enumerate(bones):
        turn = np.zeros((count, 3)) if "Twist" in name else np.cumsum(rng.normal(0.0, 0.04, (count, 3)), axis=0)
        own = euler_to_matrix("xyz", turn)
        if parents[k] < 0:
            rotations[:, k] = own
            continue
        rotations[:, k] = rotations[:, parents[k]] @ own
        points[:, k] = points[:, parents[k]] + rotations[:, parents[k]] @ np.array(offset)
    return Bvh(tuple(names), parents, points, rotations, 30.0)


def without_names(file: Bvh) -> Bvh:
    return replace(file, names=tuple(f"j{k}{END if name.endswith(END) else ''}" for k, name in enumerate(file.names)))


OF_A_SIDE = ("Hip", "Knee", "Ankle", "Toe", "Shoulder", "Elbow", "Wrist")
ROLES = ("Head", *(f"{side}{role}" for side in "LR" for role in OF_A_SIDE))


@pytest.mark.nightly
@given(st.booleans(), st.booleans(), st.booleans(), st.booleans(), st.booleans(), st.integers(0, 10_000))
@settings(max_examples=40, deadline=None)
def test_joints_without_names_have_the_right_roles(twist, fingers, socket, toes, face, seed):
    file = skeleton(twist=twist, fingers=fingers, socket=socket, toes=toes, face=face, seed=seed)
    found = roles_by_structure(without_names(file))
    assert {role: file.names[k] for role, k in found.items()} == {role: role for role in ROLES}


def test_raised_arms_are_not_taken_for_legs() -> None:
    """Both pairs of limbs point away from each other then."""
    file = skeleton(fingers=True)
    points, chest = file.points.copy(), file.names.index("Chest")
    for k, name in enumerate(file.names):
        if re.match(r"[LR](Elbow|Wrist|F\d)", name):  # the arms turned up about the shoulders
            out = 1.0 if name[0] == "L" else -1.0
            line = (points[:, k] - points[:, file.names.index(f"{name[0]}Shoulder")]) @ file.rotations[0, chest]
            raised = np.stack([-out * line[:, 1], out * line[:, 0], line[:, 2]], axis=1) @ file.rotations[0, chest].T
            points[:, k] = points[:, file.names.index(f"{name[0]}Shoulder")] + raised
    found = roles_by_structure(replace(without_names(file), points=points))
    assert {role: file.names[k] for role, k in found.items()} == {role: role for role in ROLES}


def renamed(file: Bvh, arms: str, legs: str) -> Bvh:
    """Names that say the side of the arms, of the legs, or of neither.  arms, legs: "", as they are, or exchanged, "x"."""

    def name(k: int, old: str) -> str:
        kind = legs if re.match(r"[LR](Hip|Knee|Ankle|Toe)", old) else arms if re.match("[LR][A-Z]", old) else ""
        side = {"": "", "as": old[0], "x": "R" if old[0] == "L" else "L"}[kind]
        return f"{side} j{k}{END if old.endswith(END) else ''}".strip()

    return replace(file, names=tuple(name(k, old) for k, old in enumerate(file.names)))


def test_names_decide_the_sides_against_the_feet_and_those_of_the_arms_alone_too() -> None:
    """Sides are exchanged in a file of a left-handed world."""
    file = skeleton()
    for arms, legs, knee in (("as", "", "LKnee"), ("x", "", "RKnee"), ("", "x", "RKnee"), ("x", "x", "RKnee")):
        found = roles_by_structure(renamed(file, arms, legs))
        assert file.names[found["LKnee"]] == knee
        assert file.names[found["LElbow"]] == knee[0] + "Elbow"
    with pytest.raises(StructureError, match="the names of arms and legs call opposite sides left"):
        roles_by_structure(renamed(file, "as", "x"))


@pytest.mark.slow
def test_the_search_is_not_quadratic_in_the_branches_of_a_joint(monkeypatch: pytest.MonkeyPatch) -> None:
    """A file of 200 kB with 3000 joints at one place took 43 s."""
    count, calls = 3000, 0
    ends = np.random.default_rng(0).normal(0.0, 1.0, (count, 3))
    points = np.concatenate([np.zeros((1, 3)), ends / np.linalg.norm(ends, axis=1, keepdims=True)])[None]
    names = tuple(f"j{k}" for k in range(count + 1))
    star = Bvh(names, (-1, *[0] * count), points, np.tile(np.eye(3), (1, count + 1, 1, 1)), 30.0)
    way_down = Tree.way_down

    def counted(tree: Tree, joint: int) -> list[int]:
        nonlocal calls
        calls += 1
        return way_down(tree, joint)

    monkeypatch.setattr(Tree, "way_down", counted)
    with pytest.raises(StructureError, match="no two pairs"):
        roles_by_structure(star)
    assert 0 < calls <= count


@pytest.mark.parametrize(
    ("name", "side"),
    [
        ("Left leg", "L"), ("leg_R", "R"), ("lower", ""), ("LowerLeg", ""), ("rShin", "R"), ("kneeR", "R"), ("Root", ""),
        ("L Hand", "L"),
    ],
)  # fmt: skip
def test_sides_in_names(name: str, side: str) -> None:
    assert side_of(name) == side


def test_what_is_no_human_is_refused_with_both_reasons() -> None:
    file = skeleton()
    keep = [k for k, name in enumerate(file.names) if not re.match(r"[LR](Hip|Knee|Ankle|Toe)", name)]
    legless = Bvh(
        tuple(f"j{k}" for k in keep), tuple(keep.index(file.parents[k]) if file.parents[k] >= 0 else -1 for k in keep),
        file.points[:, keep], file.rotations[:, keep], file.rate,
    )  # fmt: skip
    with pytest.raises(StructureError, match="no two pairs of equal branches that could be legs and arms"):
        roles_by_structure(legless)
    with pytest.raises(UserError, match=r"a\.bvh: no joint for Head.*; nor does its structure say: no two pairs"):
        joint_roles(legless, Path("a.bvh"))


def test_odd_proportions_are_refused() -> None:
    file = skeleton()
    points = file.points.copy()
    for side in "LR":  # shanks of a third
        knee = file.names.index(f"{side}Knee")
        for name in ("Ankle", "Toe", f"Toe{END}"):
            k = file.names.index(f"{side}{name}")
            points[:, k] += (2 / 3) * (points[:, knee] - points[:, file.names.index(f"{side}Ankle")])
    with pytest.raises(StructureError, match="do not have thigh and shank of about equal length"):
        roles_by_structure(replace(without_names(file), points=points))


def test_a_renamed_file_gives_the_same_centres_and_says_so(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    write_bvh(tmp_path / "a.bvh", standing())
    file = read_bvh(tmp_path / "a.bvh")
    with pytest.raises(UserError, match="neither names nor feet tell left from right"):  # there are no feet in it
        centres_of(without_names(file), Path("a.bvh"))
    sides = tuple(f"{side_of(name)} {other}" for name, other in zip(file.names, without_names(file).names, strict=True))
    expected, found = centres_of(file, Path("a.bvh")), centres_of(replace(file, names=sides), Path("a.bvh"))
    assert caplog.text.count("joints taken by the structure of the skeleton") == 1
    shared = [name for name in expected.names if name in found.names and name != "Head"]
    assert len(shared) >= 14
    for name in shared:
        one, other = (centres.points[:, centres.names.index(name)] for centres in (found, expected))
        np.testing.assert_allclose(one, other, atol=1e-9, err_msg=name)


@pytest.mark.nightly
@pytest.mark.clips
@pytest.mark.parametrize("path", sorted(MOTIONS.glob("*.bvh")), ids=lambda path: path.stem)
def test_motion_capture_without_names_has_the_roles_of_its_names(path: Path) -> None:
    file = read_bvh(path)
    assert roles_by_structure(without_names(file)) == roles_of(file.names, path)
