"""Points of joint conventions: laws of motion and size, OpenSim's places, Pose2Sim's names."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.anatomies import each_anatomy, mirrored
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import ANATOMIES, FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.common.body.definition import Bdp, Pose, neutral_pose
from zenocap.common.body.joint_conventions import CONVENTIONS, Convention, left_out, origin_of, points_of
from zenocap.common.body.keypoints import keypoints
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.body.proportions import t_pose_angles
from zenocap.services.tracker.body.average_body import SHAPES, average_body

CASES = [(convention, anatomy) for convention in CONVENTIONS for anatomy in ANATOMIES.values()]
SEEDS = st.integers(0, 10_000)
NEUTRAL = neutral_pose(FOURTEEN_PARTS, np.zeros(3))

# HALPE-26 of Pose2Sim on its model with all coordinates 0, in the ground (X front, Y up, Z right), mm, by OpenSim 4.6:
# Model_Pose2Sim_simple.osim with Markers_Halpe26.xml, eyes of Markers_Coco133.xml; joints are origins of child frames.
OPENSIM = {
    "hip": (-70.7, -66.1, 83.5), "knee": (-78.8, -474.1, 80.8), "ankle": (-70.7, -893.5, 82.2),
    "shoulder": (-97.5, 453.0, 170.0), "elbow": (-84.4, 166.7, 160.4), "wrist": (-99.9, -82.1, 200.1),
    "Nose": (15.6, 605.6, 0.2), "Head": (-84.8, 757.1, 0.0), "Neck": (-101.5, 528.4, 0.2), "Hip": (-63.9, -81.3, 0.0),
    "RShoulder": (-113.5, 447.8, 201.6), "RElbow": (-72.5, 155.0, 161.3), "RWrist": (-91.3, -81.4, 196.2),
    "RHip": (-63.9, -81.3, 105.4), "RKnee": (-76.1, -464.0, 84.1), "RAnkle": (-71.0, -871.6, 97.2),
    "RBigToe": (124.0, -927.6, 76.7), "RSmallToe": (86.4, -927.9, 120.0), "RHeel": (-105.9, -912.2, 88.3),
    "REye": (-22.6, 639.7, 31.1),
}  # fmt: skip
SOLE_Y = -947.6  # lowest point of the bones of the model's feet
# The trees HALPE_26 and COCO_17 in its skeletons.py, depth first, without points that have no key point of their own.
HALPE_OF_POSE2SIM = [
    "Hip", "RHip", "RKnee", "RAnkle", "RBigToe", "RSmallToe", "RHeel", "LHip", "LKnee", "LAnkle", "LBigToe", "LSmallToe",
    "LHeel", "Neck", "Head", "Nose", "RShoulder", "RElbow", "RWrist", "LShoulder", "LElbow", "LWrist",
]  # fmt: skip
COCO_OF_POSE2SIM = [
    "RHip", "RKnee", "RAnkle", "LHip", "LKnee", "LAnkle", "Nose", "RShoulder", "RElbow", "RWrist", "LShoulder", "LElbow",
    "LWrist",
]  # fmt: skip


def random_pose(anatomy: Anatomy, seed: int) -> Pose:
    random = np.random.default_rng(seed)
    low, high = anatomy.limits.T
    return Pose(random.uniform(-2, 2, 3), random.uniform(low, high))


def named(convention: Convention, anatomy: Anatomy, bdp: Bdp, pose: Pose) -> dict[str, Floats]:
    found = keypoints(convention, anatomy, bdp)
    return dict(zip(found.names, found.at(pose), strict=True))


def model_body() -> Bdp:
    """Fourteen-part body with the lengths of Pose2Sim's model."""
    height = 1.7047
    bdp = average_body(FOURTEEN_PARTS, height)
    offsets, sizes = bdp.offsets.copy(), bdp.sizes.copy()
    for joint, part, first, second in (
        ("elbow", "upper_arm", "shoulder", "elbow"), ("knee", "upper_leg", "hip", "knee"),
        ("ankle", "lower_leg", "knee", "ankle"),
    ):  # fmt: skip
        length = np.linalg.norm(np.subtract(OPENSIM[first], OPENSIM[second])) / 1e3
        for side in ("right", "left"):
            offsets[FOURTEEN_PARTS.index[f"{side}_{joint}"], 1] = length
            sizes[FOURTEEN_PARTS.index[f"{side}_{part}"], 0] = length
    for side in ("right", "left"):  # the bones of the model's foot, at the average body's ratio of part and foot
        sizes[FOURTEEN_PARTS.index[f"{side}_foot"], 0] = 0.2655 * 0.130 / 0.1528
    for joint in ("hip", "shoulder"):
        for side, sign in (("right", -1), ("left", 1)):
            offsets[FOURTEEN_PARTS.index[f"{side}_{joint}"], 0] = sign * OPENSIM[joint][2] / 1e3
    # The vertex at the model's stature, as the limbs have other lengths than those of the average body.
    centres = joint_centres(FOURTEEN_PARTS, replace(bdp, offsets=offsets, sizes=sizes), NEUTRAL)
    ankle, vertex = (centres[[m.name for m in FOURTEEN_PARTS.markers].index(name), 1] for name in ("RAnkle", "Head"))
    sizes[FOURTEEN_PARTS.index["head"], 0] += (1 - 0.039) * height - (vertex - ankle)
    return replace(bdp, offsets=offsets, sizes=sizes)


@each_anatomy
def test_the_default_convention_is_the_joint_centres_of_the_kinematics(anatomy: Anatomy) -> None:
    bdp, pose = average_body(anatomy, 1.75), random_pose(anatomy, 1)
    found = keypoints("zenocap", anatomy, bdp)
    assert found.names == tuple(marker.name for marker in anatomy.markers)
    np.testing.assert_array_equal(found.at(pose), joint_centres(anatomy, bdp, pose))


@pytest.mark.parametrize(("convention", "anatomy"), CASES)
@settings(max_examples=20)
@given(SEEDS, st.floats(-3, 3), st.floats(0.5, 1.2))
def test_points_move_and_grow_with_the_body(
    convention: Convention, anatomy: Anatomy, seed: int, yaw: float, scale: float
) -> None:
    pose = random_pose(anatomy, seed)
    there = Pose(pose.position + np.array([0.3, -0.2, 0.9]), pose.angles.copy())
    there.angles[anatomy.index["navel.y"]] += yaw
    turn = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
    one, other = (keypoints(convention, anatomy, average_body(anatomy, height)) for height in (1.6, 1.6 * scale))
    expected = scale * (one.at(pose) - pose.position) @ turn.T + there.position
    np.testing.assert_allclose(other.at(there), expected, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("convention", "anatomy"), CASES)
@settings(max_examples=20)
@given(SEEDS)
def test_the_mirrored_pose_has_the_mirrored_points(convention: Convention, anatomy: Anatomy, seed: int) -> None:
    bdp, pose = average_body(anatomy, 1.75), random_pose(anatomy, seed)
    mirror = np.array([-1.0, 1.0, 1.0])
    there = Pose(mirror * pose.position, mirrored(anatomy, pose.angles))
    found = named(convention, anatomy, bdp, pose)
    for name, point in named(convention, anatomy, bdp, there).items():
        other = {"R": "L", "L": "R"}.get(name[0], "") + name[1:]
        np.testing.assert_allclose(point, mirror * found.get(other, found.get(name)), atol=1e-9, err_msg=name)


@pytest.mark.parametrize(
    ("point", "joint"),
    [
        ("RHip", "hip"), ("RKnee", "knee"), ("RShoulder", "shoulder"), ("RElbow", "elbow"), ("RWrist", "wrist"),
        ("Hip", "hip"), ("Neck", "shoulder"), ("Nose", "Head"), ("REye", "Head"), ("RSmallToe", "RHeel"),
        ("RBigToe", "RHeel"),
    ],
)  # fmt: skip
def test_halpe_points_lie_as_on_the_model_of_pose2sim(point: str, joint: str) -> None:
    """The vector from a joint centre, or another point, to the point is that of OpenSim's own kinematics."""
    found, own = (named(convention, FOURTEEN_PARTS, model_body(), NEUTRAL) for convention in ("halpe", "isb"))
    isb = {"hip": "RHJC", "knee": "RKJC", "shoulder": "RGH", "elbow": "REJC", "wrist": "RWJC"}
    start = own[isb[joint]] if joint in isb else found[joint]
    x, y, z = 1e3 * (found[point] - start)
    expected = np.subtract(OPENSIM[point], OPENSIM[joint])
    across = point in ("RElbow", "RWrist")  # offsets across the arm are left out
    tolerance = np.array([12.0, 1.0, 5.0]) if across else np.full(3, 1.0)
    assert (np.abs(np.array([z, y, -x]) - expected) <= tolerance).all(), (z, y, -x, expected)


@pytest.mark.parametrize("point", ["RAnkle", "RHeel", "RBigToe", "RSmallToe"])
def test_halpe_points_of_the_foot_have_their_height_above_the_sole(point: str) -> None:
    found, own = (named(convention, FOURTEEN_PARTS, model_body(), NEUTRAL) for convention in ("halpe", "isb"))
    height = 1e3 * (found[point] - own["RAJC"])[1] + 0.039 * 1704.7
    # 4 mm: the foot of the average body is 0.037 statures deep below the ankle, whose height is 0.039.
    assert height == pytest.approx(OPENSIM[point][1] - SOLE_Y, abs=4.5)


def test_the_foot_is_that_of_the_average_body() -> None:
    """The reference length of the foot in `joint_conventions` presumes this share of stature."""
    assert SHAPES["foot"][0][0] == 0.130


def test_ears_and_eyes_are_where_ansur_has_them() -> None:
    """Mean of both sexes: tragion 0.0763 and eye 0.0659 below the vertex, pupils 0.0372 apart, in statures."""
    average = average_body(FOURTEEN_PARTS, 1.0)
    at = named("coco", FOURTEEN_PARTS, average, NEUTRAL)
    top = named("zenocap", FOURTEEN_PARTS, average, NEUTRAL)["Head"][1]
    assert top - at["REar"][1] == pytest.approx(0.0763, abs=1e-3)
    assert top - at["REye"][1] == pytest.approx(0.0659, abs=4e-3)
    assert np.linalg.norm(at["LEye"] - at["REye"]) == pytest.approx(0.0372, abs=1e-3)
    assert np.linalg.norm(at["LEar"] - at["REar"]) == pytest.approx(0.0818, abs=1e-3)


def test_the_bend_of_the_spine_moves_the_joints_above_it() -> None:
    """Bending the chest forward by 90 degrees at the waist lays thorax and neck in front of it and moves nothing else."""
    bent = neutral_pose(FOURTEEN_PARTS, np.zeros(3))
    bent.angles[FOURTEEN_PARTS.index["waist.x"]] = np.pi / 2
    body = keypoints("isb", FOURTEEN_PARTS, average_body(FOURTEEN_PARTS, 1.75), spine=True)
    before, after = (dict(zip(body.names, body.at(pose), strict=True)) for pose in (NEUTRAL, bent))
    for name in ("Pelvis", "Spine", "RHJC", "RKJC"):
        np.testing.assert_allclose(after[name], before[name], atol=1e-12)
    for name in ("Thorax", "UpperNeck"):
        across, up, front = before[name] - before["Spine"]
        np.testing.assert_allclose(after[name] - before["Spine"], [across, -front, up], atol=1e-12)
        assert up > 0.3


def test_names_and_order_are_those_of_pose2sim() -> None:
    faces = ["REye", "REar", "LEye", "LEar"]
    assert [point.name for point in points_of("halpe", FOURTEEN_PARTS)] == HALPE_OF_POSE2SIM + faces
    assert [point.name for point in points_of("coco", FOURTEEN_PARTS)] == COCO_OF_POSE2SIM + faces
    counts = {c: len(points_of(c, FOURTEEN_PARTS)) for c in CONVENTIONS}
    assert counts == {"zenocap": 15, "isb": 12, "coco": 17, "halpe": 26}


def test_ten_parts_have_no_feet() -> None:
    feet = ("RBigToe", "RSmallToe", "RHeel", "LBigToe", "LSmallToe", "LHeel")
    assert left_out("halpe", TEN_PARTS) == feet
    assert len(points_of("halpe", TEN_PARTS)) == 20
    for convention, anatomy in CASES:
        if (convention, anatomy) != ("halpe", TEN_PARTS):
            assert left_out(convention, anatomy) == ()


def test_points_are_measured_at_a_share_or_derived() -> None:
    for anatomy, ankle in ((TEN_PARTS, "share"), (FOURTEEN_PARTS, "measured")):
        origins = {point.name: origin_of(point, anatomy) for point in points_of("isb", anatomy)}
        assert (origins["RAJC"], origins["RHJC"], origins["RWJC"]) == (ankle, "measured", "share")
        assert {origin_of(p, anatomy) for p in points_of("halpe", anatomy)} == {"share", "derived"}


def test_neck_and_wrists_of_the_t_pose_are_at_the_height_of_the_conventions() -> None:
    """The neck is 81 mm above the middle of the shoulders on a model 1.70 m tall; arms sideways keep their wrists level."""
    at = named("halpe", FOURTEEN_PARTS, model_body(), Pose(np.zeros(3), t_pose_angles(FOURTEEN_PARTS)))
    middle = (at["RShoulder"] + at["LShoulder"]) / 2
    assert 1e3 * (at["Neck"] - middle)[1] == pytest.approx(80.6, abs=0.5)
    assert at["RWrist"][1] == pytest.approx(at["RElbow"][1], abs=1e-9)


def test_an_unknown_convention_is_refused() -> None:
    with pytest.raises(ValueError, match="joints = 'body25': allowed: zenocap, isb, coco, halpe"):
        keypoints("body25", TEN_PARTS, average_body(TEN_PARTS, 1.75))  # type: ignore[arg-type]  # that is the test
