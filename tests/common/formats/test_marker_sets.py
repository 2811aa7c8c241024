"""Joint centres of TRC and C3D files by the names of the usual key points and optical markers."""

import logging
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.support.marker_files import TO_Z_UP, acted_centres, optical_markers, write_points
from tests.support.pose_tracks import moving
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.inverse_kinematics import NEEDED
from zenocap.common.errors import UserError
from zenocap.common.formats.c3d import write_c3d
from zenocap.common.formats.joint_map import JointMap
from zenocap.common.formats.motion_files import read_centres, read_poses_for
from zenocap.common.formats.trajectories import Axes, Trajectories, convert
from zenocap.common.formats.trc import write_trc

MILLIMETRE = 1e-3
OTHER_SIDE = {"R": "L", "L": "R"}
WORDS = {"R": "right", "L": "left"}


def snake(name: str) -> str:
    return f"{WORDS[name[0]]}_{name[1:].lower()}" if name[0] in WORDS else name.lower()


SPELLINGS = {  # of the names of joint centres, from ours
    "BODY_25, HALPE-26, COCO-17": lambda name: name,
    "BODY_25 with a small neck": lambda name: name if name[0] in WORDS else name.lower(),
    "MediaPipe and COCO of programs": snake,
    "capitals": lambda name: snake(name).upper(),
    "camel": lambda name: f"{WORDS[name[0]]}{name[1:]}" if name[0] in WORDS else name,
    "with a subject": lambda name: f"ann:{name}",
    "Plug-in Gait's centres": lambda name: name[0] + {
        "Hip": "FEP", "Knee": "FEO", "Ankle": "TIO", "Shoulder": "CLO", "Elbow": "HUO", "Wrist": "RAO",
    }.get(name[1:], name[1:]) if name[0] in WORDS else name,
}  # fmt: skip


@pytest.fixture(params=[".trc", ".c3d"])
def path(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    return tmp_path / f"a{request.param}"


def centre(data: Trajectories, joint: str) -> Floats:
    return data.points[:, data.names.index(joint)]


@pytest.mark.parametrize("spelling", list(SPELLINGS))
def test_joint_centres_are_known_in_every_spelling(path: Path, spelling: str) -> None:
    centres = acted_centres()
    centres["Neck"] = 0.5 * (centres["RShoulder"] + centres["LShoulder"])
    write_points(path, {SPELLINGS[spelling](name): points for name, points in centres.items()} | {"C7": centres["Head"]})
    found = read_centres(path)
    for name, points in centres.items():
        np.testing.assert_allclose(centre(found, name), points, atol=MILLIMETRE)
    assert read_poses_for(path, TEN_PARTS).known.all()


@pytest.mark.parametrize(
    ("one", "other"),
    [("Ann:{}", "Bob:{}"), ("{}", "Bob:{}"), ("{}_1", "{}_2"), ("{}1", "{}2")],
    ids=["two names", "one name", "numbers", "digits"],
)
def test_of_two_people_the_first_whole_one_is_taken_and_said(
    one: str, other: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path, centres, aside = tmp_path / "a.trc", acted_centres(), np.array([2.0, 0.0, 0.0])
    first = {one.format(name): points for name, points in centres.items()}
    second = {other.format(name): points + aside for name, points in centres.items()}
    for given, shift in ((first, 0.0), ({name: first[name] for name in first if "Knee" not in name}, aside)):
        write_points(path, given | second)
        found = centre(read_centres(path), "RHip")
        np.testing.assert_allclose(found, centres["RHip"] + shift, atol=MILLIMETRE)
        begin = next(iter(second if shift is aside else given))
        assert f"{path}: 2 people (" in caplog.messages[-1]
        assert f"that of {begin!r} is used; for another one: a joint map (--joints)" in caplog.messages[-1]
        of_map = read_centres(path, JointMap(path, {"RKnee": (other.format("RKnee"),)}))
        np.testing.assert_allclose(centre(of_map, "RHip"), centres["RHip"] + aside, atol=MILLIMETRE)
    caplog.clear()
    write_points(path, first | {f"Box:{name}": centres[name] for name in ("LKnee", "RKnee", "RAnkle", "LAnkle")})
    read_centres(path)
    assert not caplog.messages


@pytest.mark.parametrize("convention", ["zenocap", "isb", "coco", "halpe"])
def test_exports_in_every_convention_are_read_back(path: Path, convention: str) -> None:
    data = moving(20).trajectories(convention)
    (write_trc if path.suffix == ".trc" else write_c3d)(path, data)
    found = read_centres(path)
    assert set(NEEDED) <= set(found.names)
    np.testing.assert_allclose(found.times_s, data.times_s, atol=1e-6)
    wrist = {"isb": "RWJC"}.get(convention, "RWrist")
    np.testing.assert_allclose(centre(found, "RWrist"), centre(data, wrist), atol=MILLIMETRE)


def test_the_crown_is_above_the_ears_where_a_set_has_no_head(tmp_path: Path) -> None:
    track = moving(20)
    write_trc(tmp_path / "a.trc", track.trajectories("coco"))
    own = track.trajectories("zenocap")
    # Names in capitals are not taken as they are, so the crown is derived.
    text = (tmp_path / "a.trc").read_text()
    (tmp_path / "a.trc").write_text(text.replace("RHip", "right_hip"))
    off = centre(read_centres(tmp_path / "a.trc"), "Head") - centre(own, "Head")
    assert np.linalg.norm(off, axis=1).max() < 0.05


@pytest.mark.parametrize("medial", [False, True])
def test_plug_in_gait_markers_give_the_joint_centres(path: Path, medial: bool) -> None:
    write_points(path, optical_markers(medial=medial))
    found = read_centres(path)
    for name, points in acted_centres().items():
        if name != "Head":
            off = np.linalg.norm(centre(found, name) - points, axis=1)
            # Without a medial marker the rule takes the plane of the elbow's marker for that of its centre.
            assert off.max() < (0.025 if name[1:] == "Elbow" and not medial else 0.006), name


def test_knees_and_ankles_without_a_marker_that_gives_their_plane_are_named_in_a_warning(tmp_path, caplog):
    points = optical_markers(medial=True)
    write_points(tmp_path / "a.c3d", points)
    read_centres(tmp_path / "a.c3d")
    assert "markers on thigh" not in caplog.text
    caplog.clear()
    del points["LKNM"], points["LMED"], points["RMED"]
    points["RTIB"] = 0.5 * (points["RKNE"] + points["RANK"]) + [0.0, 0.0, 0.05]
    write_points(tmp_path / "b.c3d", points)
    read_centres(tmp_path / "b.c3d")
    text = next(line for line in caplog.messages if "markers on thigh" in line)
    assert str(tmp_path / "b.c3d") in text
    assert "no LTHI or LKNM: knees up to 104 mm off instead of 21" in text
    assert "; no LTIB or LMED: ankles up to 98 mm off instead of 14" in text


def test_a_marker_of_the_thigh_in_line_with_hip_and_knee_counts_as_missing(tmp_path, caplog):
    points, centres = optical_markers(), acted_centres()
    for side in "RL":
        points[f"{side}THI"] = 0.5 * (centres[f"{side}Hip"] + points[f"{side}KNE"])
        points[f"{side}TIB"] = 0.5 * (points[f"{side}KNE"] + points[f"{side}ANK"]) + [0.0, 0.0, 0.05]
    write_points(tmp_path / "a.trc", points)
    read_centres(tmp_path / "a.trc")
    assert "no LTHI or LKNM, RTHI or RKNM: knees" in caplog.text
    assert "ankles up to" not in caplog.text


def test_helen_hayes_names_and_a_sacral_marker_are_known(tmp_path: Path) -> None:
    own = optical_markers(medial=True)
    named = {
        "ASI": "ASIS", "KNE": "Knee", "ANK": "Ankle", "SHO": "Shoulder", "ELB": "Elbow", "WRA": "Wrist",
        "KNM": "Knee.Medial", "MED": "Ankle.Medial", "ELM": "Elbow.Medial",
    }  # fmt: skip
    points = {f"{name[0]}.{named[name[1:]]}": values for name, values in own.items() if name[1:] in named}
    write_points(tmp_path / "a.trc", points | {"V.Sacral": 0.5 * (own["RPSI"] + own["LPSI"])})
    hip = centre(read_centres(tmp_path / "a.trc"), "RHip")
    np.testing.assert_allclose(hip, acted_centres()["RHip"], atol=2 * MILLIMETRE)


def test_a_world_with_z_up_is_turned_and_the_log_says_so(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    centres = acted_centres()
    turned = {name: points @ TO_Z_UP.T for name, points in centres.items()}
    write_points(tmp_path / "a.c3d", turned)
    write_points(tmp_path / "a.trc", turned)
    with caplog.at_level(logging.WARNING):
        of_c3d = read_centres(tmp_path / "a.c3d")
        assert not caplog.records  # usual in C3D
        of_trc = read_centres(tmp_path / "a.trc")
    assert "z is taken for up" in caplog.text
    for found in (of_c3d, of_trc):
        np.testing.assert_allclose(centre(found, "LWrist"), centres["LWrist"], atol=MILLIMETRE)


@pytest.mark.parametrize("axes", ["unity", "unreal", "y-up"])
@pytest.mark.parametrize("made", [acted_centres, optical_markers], ids=["centres", "markers"])
def test_a_left_handed_file_is_mirrored_and_the_log_says_so(
    path: Path, axes: Axes, made: Callable[[], dict[str, Floats]], caplog: pytest.LogCaptureFixture
) -> None:
    write_points(path, made())
    expected = read_poses_for(path, TEN_PARTS).poses
    caplog.clear()
    write_points(path, {name: convert(points, axes) for name, points in made().items()})
    found = read_poses_for(path, TEN_PARTS).poses
    text = "x is mirrored, as knees and feet point backwards: the file is left-handed, or exchanges left and right"
    assert caplog.messages.count(f"{path}: {text}") == (axes != "y-up")
    for pose, same in zip(found, expected, strict=True):
        np.testing.assert_allclose(pose.angles[1:], same.angles[1:], atol=0.02)  # but the heading


def test_exchanged_sides_look_left_handed_and_straight_legs_do_not_say(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path, centres = tmp_path / "a.trc", acted_centres()
    write_points(path, {OTHER_SIDE.get(name[0], name[0]) + name[1:]: points for name, points in centres.items()})
    read_centres(path)
    assert "or exchanges left and right" in caplog.text
    caplog.clear()
    straight = {name: convert(points[:1].repeat(20, axis=0), "unity") for name, points in centres.items()}
    write_points(path, straight)
    read_centres(path)
    assert not caplog.messages


@pytest.mark.parametrize(("factor", "said"), [(1000.0, True), (1e-3, True), (1 / 2.54, True), (0.6, False), (1.0, False)])
def test_a_unit_that_contradicts_the_body_is_said(
    path: Path, factor: float, said: bool, caplog: pytest.LogCaptureFixture
) -> None:
    """Millimetres as metres, metres as millimetres, inches as centimetres; a child; an adult."""
    write_points(path, {name: factor * points for name, points in acted_centres().items()})
    read_centres(path)
    text = "by the unit that the file states (Units, POINT:UNITS) a leg is "
    assert (text in caplog.text) == said


def test_frames_without_a_marker_have_no_centre_of_its_joint(tmp_path: Path) -> None:
    points = optical_markers()
    points["RKNE"][10:40] = np.nan
    write_points(tmp_path / "a.c3d", points)
    found = read_centres(tmp_path / "a.c3d")
    lost = np.isnan(centre(found, "RKnee")).all(axis=1)
    assert list(np.flatnonzero(lost)) == list(range(10, 40))
    assert np.isfinite(centre(found, "LKnee")).all()
    assert list(np.flatnonzero(~read_poses_for(tmp_path / "a.c3d", TEN_PARTS).known)) == list(range(10, 40))


def test_errors_list_the_missing_markers_of_the_set_that_fits_best(tmp_path: Path) -> None:
    points = optical_markers()
    for name in ("RPSI", "LPSI", "LELB"):
        del points[name]
    write_points(tmp_path / "a.c3d", points)
    with pytest.raises(UserError, match=r"no marker LPSI \(or SACR\), RPSI \(or SACR\), LELB; there are: RASI, RKNE"):
        read_centres(tmp_path / "a.c3d")
    centres = acted_centres()
    del centres["RWrist"]
    write_points(tmp_path / "a.trc", centres)
    with pytest.raises(UserError, match=r"no marker RWrist; there are: .*; allowed for RWrist, with its side: wrist, wjc"):
        read_centres(tmp_path / "a.trc")
    empty = optical_markers()
    empty["LELB"][:] = np.nan
    write_points(tmp_path / "b.c3d", empty)
    with pytest.raises(UserError, match=r"marker Lelbow: in no frame"):
        read_centres(tmp_path / "b.c3d")
