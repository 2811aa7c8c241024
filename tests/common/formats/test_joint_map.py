"""Joint maps: any names become readable; errors name file, key and value."""

from pathlib import Path

import numpy as np
import pytest

from tests.support.marker_files import acted_centres, write_points
from tests.support.places import ROOT
from zenocap.common.errors import UserError
from zenocap.common.formats.bvh_joint_names import joint_roles
from zenocap.common.formats.bvh_reader import Bvh
from zenocap.common.formats.joint_map import JOINTS, JointMap, read_joint_map
from zenocap.common.formats.motion_files import read_centres

DOCUMENTATION = ROOT / "docs" / "postures.md"
NEUTRAL_NAMES = {name: f"p{k}" for k, name in enumerate(JOINTS) if name not in ("RToe", "LToe")}


def mapped(folder: Path, text: str) -> JointMap:
    (folder / "map.toml").write_text(text, encoding="utf-8")
    return read_joint_map(folder / "map.toml")


def test_the_documented_map_is_valid(tmp_path: Path) -> None:
    text = DOCUMENTATION.read_text(encoding="utf-8")
    block = next(block for block in text.split("```toml\n")[1:] if "[joints]" in block).split("```")[0]
    found = mapped(tmp_path, block)
    assert (found.up, found.joints["RKnee"]) == ("z", ("knee_medial", "knee_lateral"))


def test_points_of_any_names_are_joints_by_the_map(tmp_path: Path) -> None:
    centres = acted_centres()
    write_points(tmp_path / "a.trc", {NEUTRAL_NAMES[name]: points for name, points in centres.items()})
    lines = "\n".join(f'{joint} = "{name}"' for joint, name in NEUTRAL_NAMES.items())
    found = read_centres(tmp_path / "a.trc", mapped(tmp_path, f"[joints]\n{lines}\n"))
    for name, points in centres.items():
        np.testing.assert_allclose(found.points[:, found.names.index(name)], points, atol=1e-5)


def test_a_list_is_the_middle_of_markers_and_up_the_axis_of_the_file(tmp_path: Path) -> None:
    centres = acted_centres()
    points = {name: values for name, values in centres.items() if name != "RKnee"}
    points |= {"med": centres["RKnee"] + [0.05, 0, 0], "lat": centres["RKnee"] - [0.05, 0, 0]}
    lying = {name: values @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]) for name, values in points.items()}
    write_points(tmp_path / "a.trc", lying)  # the person lies, as -z of the file is where its head points
    names = mapped(tmp_path, 'up = "y"\n[joints]\nRKnee = ["med", "lat"]\n')
    found = read_centres(tmp_path / "a.trc", names)
    wanted = centres["RKnee"] @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    np.testing.assert_allclose(found.points[:, found.names.index("RKnee")], wanted, atol=1e-5)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", 'joints = None: allowed: a table [joints] with a line such as RHip = "name"'),
        ("[joints]\n", "joints = {}: allowed: a table"),
        ('[joints]\nRHipp = "a"', "joints.RHipp: allowed: Head, RHip, RKnee"),
        ("[joints]\nRHip = 3", "joints.RHip = 3: allowed: a name, or a list"),
        ("[joints]\nRHip = []", r"joints.RHip = []: allowed: a name"),
        ('[joints]\nRHip = ["a", "a"]', "different names"),
        ('[joints]\nRHip = "a"\nLHip = "a"', "joints.LHip = 'a': it is joints.RHip too: allowed: each name once"),
        ('up = "w"\n[joints]\nRHip = "a"', "up = 'w': allowed: 'x', 'y', 'z'"),
        ('down = "x"\n[joints]\nRHip = "a"', "map.toml: down: allowed: up, joints"),
        ("[joints", "map.toml: not TOML"),
    ],
)
def test_a_wrong_map_is_an_error_that_names_file_key_and_value(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(UserError) as raised:
        mapped(tmp_path, text)
    assert str(raised.value).startswith(str(tmp_path / "map.toml"))
    assert words in str(raised.value)
    assert len(str(raised.value).splitlines()) == 1


def test_names_that_the_file_lacks_and_joints_that_nothing_names_are_errors(tmp_path: Path) -> None:
    centres = acted_centres()
    write_points(tmp_path / "a.trc", {NEUTRAL_NAMES[name]: points for name, points in centres.items()})
    with pytest.raises(UserError, match=r"map\.toml: joints\.RHip = 'hip': allowed: a name in .*a\.trc: p1, p2"):
        read_centres(tmp_path / "a.trc", mapped(tmp_path, '[joints]\nRHip = "hip"'))
    with pytest.raises(UserError, match=r"no marker RKnee, RAnkle.*LWrist; there are: p1.*or a line in .*map\.toml"):
        read_centres(tmp_path / "a.trc", mapped(tmp_path, '[joints]\nRHip = "p1"'))


def skeleton(names: tuple[str, ...]) -> Bvh:
    """Joints without motion in one line; only their names matter."""
    points = np.zeros((1, len(names), 3))
    rotations = np.broadcast_to(np.eye(3), (1, len(names), 3, 3))
    return Bvh(names, tuple(range(-1, len(names) - 1)), points, rotations, 30.0)


KNOWN = ("hips", "Head", "RightUpLeg", "RightLeg", "RightFoot", "LeftUpLeg", "LeftLeg", "LeftFoot")
ARMS = ("RightArm", "RightForeArm", "RightHand", "LeftArm", "LeftForeArm")


@pytest.mark.parametrize("known", [(), ("LeftHand",)])
def test_the_map_wins_over_a_known_name_and_other_joints_are_taken_by_their_names(tmp_path, known):
    file = skeleton((*KNOWN, *ARMS, *known, "paw"))
    found = joint_roles(file, Path("a.bvh"), joints=mapped(tmp_path, '[joints]\nLWrist = "paw"\n'))
    assert file.names[found["LWrist"]] == "paw"
    assert file.names[found["LElbow"]] == "LeftForeArm"


def test_a_joint_with_two_roles_is_an_error(tmp_path: Path) -> None:
    file = skeleton((*KNOWN, *ARMS, "LeftHand"))
    with pytest.raises(UserError, match="'LeftForeArm' is LWrist by the joint map, and LElbow without it"):
        joint_roles(file, Path("a.bvh"), joints=mapped(tmp_path, '[joints]\nLWrist = "LeftForeArm"\n'))
    with pytest.raises(UserError, match=r"joints\.LWrist = \['LeftHand', 'RightHand'\]: allowed for a\.bvh: one name"):
        joint_roles(file, Path("a.bvh"), joints=mapped(tmp_path, '[joints]\nLWrist = ["LeftHand", "RightHand"]\n'))
