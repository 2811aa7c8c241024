import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from two_view_scene import ANGLES, BDP

from common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy, Floats
from common.body.definition import Bdp
from common.codec import decode, encode
from common.conversion import anatomy_of, angles_by_name, angles_of, bdp_of, body_of, camera_of, packed_points, points_of
from common.messages import MOST_POINTS, CameraInfo, ScenePoints, TrackerBdp, UniversalBdp


def test_a_body_travels_and_comes_back() -> None:
    message = UniversalBdp(frame=1, captured_ns=2, body=body_of(TEN_PARTS, BDP), ratio=1.0)
    back = bdp_of(TEN_PARTS, decode(encode(message), UniversalBdp).body)
    np.testing.assert_array_equal(back.sizes, BDP.sizes)
    np.testing.assert_array_equal(back.offsets, BDP.offsets)


@given(ANGLES)
def test_angles_travel_by_name(angles: Floats) -> None:
    named = angles_by_name(TEN_PARTS, angles)
    assert set(named) == set(TEN_PARTS.angles)
    assert all(type(value) is float for value in named.values())
    np.testing.assert_array_equal(angles_of(TEN_PARTS, named, TEN_PARTS.neutral), angles)


def test_angles_that_are_not_named_stay() -> None:
    others = TEN_PARTS.neutral
    before = others.copy()
    found = angles_of(TEN_PARTS, {"right_knee.x": -0.4}, others)
    assert found[TEN_PARTS.index["right_knee.x"]] == -0.4
    found[TEN_PARTS.index["right_knee.x"]] = before[TEN_PARTS.index["right_knee.x"]]
    np.testing.assert_array_equal(found, before)
    np.testing.assert_array_equal(others, before)


def test_an_angle_of_nobody_is_refused_by_name() -> None:
    with pytest.raises(ValueError, match=r"joint angle 'tail\.x' is not one of anatomy 'ten-parts'"):
        angles_of(TEN_PARTS, {"tail.x": 0.1}, TEN_PARTS.neutral)


def test_a_body_of_another_anatomy_is_refused() -> None:
    other = Anatomy("eleven-parts", TEN_PARTS.joints, TEN_PARTS.markers, TEN_PARTS.circular)
    with pytest.raises(ValueError, match="body: anatomy is 'eleven-parts'; this service knows 'ten-parts'"):
        bdp_of(TEN_PARTS, body_of(other, BDP))


def test_a_body_that_lacks_a_part_or_joint_is_refused_by_name() -> None:
    body = body_of(TEN_PARTS, BDP)
    del body.sizes["head"]
    del body.offsets["left_knee"]
    with pytest.raises(ValueError, match="body: head, left_knee missing"):
        bdp_of(TEN_PARTS, body)


def tapered(anatomy: Anatomy) -> Bdp:
    """A body of which every number is another."""
    parts, joints = len(anatomy.parts), len(anatomy.joints)
    sizes, offsets = 0.1 + np.arange(3.0 * parts) / 100, np.arange(3.0 * joints) / 100
    tips, bases = 0.05 + np.arange(2.0 * parts) / 100, -np.arange(3.0 * parts) / 100
    return Bdp(sizes.reshape(-1, 3), offsets.reshape(-1, 3), tips.reshape(-1, 2), bases.reshape(-1, 3))


def test_a_tapered_body_travels_with_its_tips_and_bases() -> None:
    bdp = tapered(FOURTEEN_PARTS)
    message = TrackerBdp(frame=1, captured_ns=2, body=body_of(FOURTEEN_PARTS, bdp))
    body = decode(encode(message), TrackerBdp).body
    back = bdp_of(anatomy_of(body), body)
    assert back.tips is not None
    assert back.bases is not None
    for name in ("sizes", "offsets", "tips", "bases"):
        np.testing.assert_array_equal(getattr(back, name), getattr(bdp, name))


def test_a_body_of_cylinders_says_nothing_of_tips() -> None:
    """Its bytes are those of a version that knew none."""
    data = encode(UniversalBdp(frame=1, captured_ns=2, body=body_of(TEN_PARTS, BDP), ratio=1.0))
    assert b"tips" not in data
    assert b"bases" not in data
    assert bdp_of(TEN_PARTS, body_of(TEN_PARTS, BDP)).tips is None


def test_a_body_with_some_tips_needs_all() -> None:
    body = body_of(FOURTEEN_PARTS, tapered(FOURTEEN_PARTS))
    del body.tips["head"]
    del body.bases["left_foot"]
    with pytest.raises(ValueError, match="body: head, left_foot missing"):
        bdp_of(FOURTEEN_PARTS, body)


def test_an_anatomy_that_nobody_knows_is_refused_with_those_there_are() -> None:
    body = body_of(Anatomy("eleven-parts", TEN_PARTS.joints, TEN_PARTS.markers, TEN_PARTS.circular), BDP)
    with pytest.raises(ValueError, match="anatomy 'eleven-parts': allowed: ten-parts, fourteen-parts"):
        anatomy_of(body)


def scene_points(points: Floats) -> ScenePoints:
    message = ScenePoints(frame=1, captured_ns=2, points=packed_points(points))
    return decode(encode(message), ScenePoints)


@given(arrays(np.float64, st.tuples(st.integers(0, 30), st.just(3)), elements=st.floats(-32.7, 32.7)))
def test_scene_points_travel_to_the_millimetre(points: Floats) -> None:
    np.testing.assert_allclose(points_of(scene_points(points)), points, atol=0.00051)


def test_scene_points_beyond_16_bits_and_beyond_the_most_are_left_out() -> None:
    far = np.array([[0.0, 1.0, 40.0], [1.0, 2.0, 3.0], [0.0, -32.768, 0.0]])
    np.testing.assert_allclose(points_of(scene_points(far)), [[1.0, 2.0, 3.0]])
    assert len(points_of(scene_points(np.zeros((MOST_POINTS + 1, 3))))) == MOST_POINTS


def test_bytes_that_are_no_whole_points_are_refused() -> None:
    with pytest.raises(ValueError, match="points: 7 bytes; allowed: a multiple of 6"):
        points_of(ScenePoints(frame=0, captured_ns=0, points=b"1234567"))


def camera(**changes: object) -> CameraInfo:
    info = CameraInfo(
        frame=0, captured_ns=0, viewer="1", name="cam01", size=(160, 120), matrix=[150.0, 0, 80, 0, 150, 60, 0, 0, 1],
        distortions=[], rotation=[1.0, 0, 0, 0, -1, 0, 0, 0, -1], translation=[0.0, 1.0, 5.0],
    )  # fmt: skip
    return msgspec.structs.replace(info, **changes)


def test_a_camera_of_a_message_projects_as_it_says() -> None:
    found = camera_of(camera())
    np.testing.assert_allclose(found.project(np.array([[0.5, 2.0, 0.0]])), [[80 + 15, 60 - 30]])


@pytest.mark.parametrize(
    "changes",
    [
        {"matrix": [1.0] * 9},
        {"matrix": [0.0, 0, 80, 0, 150, 60, 0, 0, 1]},
        {"rotation": [1.0, 0, 0, 0, 1, 0, 0, 0, -1]},
        {"rotation": [1.0] * 9},
        {"distortions": [0.1] * 3},
        {"size": (0, 120)},
    ],
)
def test_what_no_camera_can_be_is_refused_with_its_name_and_what_is_allowed(changes: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r"camera cam01: .*; allowed: "):
        camera_of(camera(**changes))
