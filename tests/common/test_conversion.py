"""Conversion between messages and types of the mathematics: round trips, errors."""

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tests.support.built_messages import built
from tests.support.two_view_scene import ANGLES, BDP
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.common.body.definition import Bdp
from zenocap.common.codec import decode, encode
from zenocap.common.conversion import (
    anatomy_of,
    angles_by_name,
    angles_of,
    bdp_of,
    body_of,
    camera_of,
    packed_points,
    points_of,
)
from zenocap.common.messages import MOST_POINTS, CameraInfo, ScenePoints, TrackerBdp, UniversalBdp


def test_a_body_round_trips() -> None:
    message = UniversalBdp(frame=1, captured_ns=2, body=body_of(TEN_PARTS, BDP), ratio=1.0)
    back = bdp_of(TEN_PARTS, decode(encode(message), UniversalBdp).body)
    np.testing.assert_array_equal(back.sizes, BDP.sizes)
    np.testing.assert_array_equal(back.offsets, BDP.offsets)


@given(ANGLES)
def test_angles_round_trip_by_name(angles: Floats) -> None:
    named = angles_by_name(TEN_PARTS, angles)
    assert set(named) == set(TEN_PARTS.angles)
    assert all(type(value) is float for value in named.values())
    np.testing.assert_array_equal(angles_of(TEN_PARTS, named, TEN_PARTS.neutral), angles)


def test_angles_missing_in_a_message_are_unchanged() -> None:
    others = TEN_PARTS.neutral
    before = others.copy()
    found = angles_of(TEN_PARTS, {"right_knee.x": -0.4}, others)
    assert found[TEN_PARTS.index["right_knee.x"]] == -0.4
    found[TEN_PARTS.index["right_knee.x"]] = before[TEN_PARTS.index["right_knee.x"]]
    np.testing.assert_array_equal(found, before)
    np.testing.assert_array_equal(others, before)


def test_an_unknown_angle_raises_an_error_that_names_it() -> None:
    with pytest.raises(ValueError, match=r"joint angle 'tail\.x' is not one of anatomy 'ten-parts'"):
        angles_of(TEN_PARTS, {"tail.x": 0.1}, TEN_PARTS.neutral)


def test_a_body_of_another_anatomy_is_refused() -> None:
    other = Anatomy("eleven-parts", TEN_PARTS.joints, TEN_PARTS.markers)
    with pytest.raises(ValueError, match="body: anatomy is 'eleven-parts'; this service uses 'ten-parts'"):
        bdp_of(TEN_PARTS, body_of(other, BDP))


def test_error_names_the_missing_part_and_joint() -> None:
    body = body_of(TEN_PARTS, BDP)
    del body.sizes["head"]
    del body.offsets["left_knee"]
    with pytest.raises(ValueError, match="body: head, left_knee missing"):
        bdp_of(TEN_PARTS, body)


def tapered(anatomy: Anatomy) -> Bdp:
    """A body whose numbers all differ."""
    parts, joints = len(anatomy.parts), len(anatomy.joints)
    sizes, offsets = 0.1 + np.arange(3.0 * parts) / 100, np.arange(3.0 * joints) / 100
    tips, bases = 0.05 + np.arange(2.0 * parts) / 100, -np.arange(3.0 * parts) / 100
    return Bdp(sizes.reshape(-1, 3), offsets.reshape(-1, 3), tips.reshape(-1, 2), bases.reshape(-1, 3))


def test_a_tapered_body_round_trips_with_tips_and_bases() -> None:
    bdp = tapered(FOURTEEN_PARTS)
    message = TrackerBdp(frame=1, captured_ns=2, body=body_of(FOURTEEN_PARTS, bdp))
    body = decode(encode(message), TrackerBdp).body
    back = bdp_of(anatomy_of(body), body)
    assert back.tips is not None
    assert back.bases is not None
    for name in ("sizes", "offsets", "tips", "bases"):
        np.testing.assert_array_equal(getattr(back, name), getattr(bdp, name))


def test_a_body_of_cylinders_has_no_tips() -> None:
    """Its bytes equal those of a version without tips."""
    data = encode(UniversalBdp(frame=1, captured_ns=2, body=body_of(TEN_PARTS, BDP), ratio=1.0))
    assert b"tips" not in data
    assert b"bases" not in data
    assert bdp_of(TEN_PARTS, body_of(TEN_PARTS, BDP)).tips is None


def test_a_body_with_tips_of_only_some_parts_is_refused() -> None:
    body = body_of(FOURTEEN_PARTS, tapered(FOURTEEN_PARTS))
    del body.tips["head"]
    del body.bases["left_foot"]
    with pytest.raises(ValueError, match="body: head, left_foot missing"):
        bdp_of(FOURTEEN_PARTS, body)


def test_an_unknown_anatomy_raises_an_error_that_lists_the_known_ones() -> None:
    body = body_of(Anatomy("eleven-parts", TEN_PARTS.joints, TEN_PARTS.markers), BDP)
    with pytest.raises(ValueError, match="anatomy 'eleven-parts': allowed: ten-parts, fourteen-parts"):
        anatomy_of(body)


def scene_points(points: Floats) -> ScenePoints:
    message = ScenePoints(frame=1, captured_ns=2, points=packed_points(points))
    return decode(encode(message), ScenePoints)


@given(arrays(np.float64, st.tuples(st.integers(0, 30), st.just(3)), elements=st.floats(-32.7, 32.7)))
def test_scene_points_round_trip_within_a_millimetre(points: Floats) -> None:
    np.testing.assert_allclose(points_of(scene_points(points)), points, atol=0.00051)


def test_scene_points_out_of_range_or_above_the_maximum_number_are_omitted() -> None:
    far = np.array([[0.0, 1.0, 40.0], [1.0, 2.0, 3.0], [0.0, -32.768, 0.0]])
    np.testing.assert_allclose(points_of(scene_points(far)), [[1.0, 2.0, 3.0]])
    assert len(points_of(scene_points(np.zeros((MOST_POINTS + 1, 3))))) == MOST_POINTS


def test_an_incomplete_point_raises_an_error() -> None:
    with pytest.raises(ValueError, match="points: 7 bytes; allowed: a multiple of 6"):
        points_of(ScenePoints(frame=0, captured_ns=0, points=b"1234567"))


def camera(**changes: object) -> CameraInfo:
    info = built(CameraInfo)
    return msgspec.structs.replace(info, **changes)


def test_a_camera_message_round_trips() -> None:
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
def test_an_invalid_camera_raises_an_error_with_its_name_and_the_allowed_values(changes: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r"camera cam01: .*; allowed: "):
        camera_of(camera(**changes))
