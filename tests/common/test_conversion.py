"""Conversion between messages and types of the mathematics: round trips, errors."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tests.support.built_messages import built
from tests.support.two_view_scene import ANGLES, BDP
from zenocap.common import conversion
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.common.body.definition import Bdp
from zenocap.common.codec import decode, encode
from zenocap.common.messages import MOST_POINTS, CameraInfo, ScenePoints, TrackerBdp


def tapered(anatomy: Anatomy) -> Bdp:
    """A body whose numbers all differ."""
    parts, joints = len(anatomy.parts), len(anatomy.joints)
    sizes, offsets = 0.1 + np.arange(3.0 * parts) / 100, np.arange(3.0 * joints) / 100
    tips, bases = 0.05 + np.arange(2.0 * parts) / 100, -np.arange(3.0 * parts) / 100
    return Bdp(sizes.reshape(-1, 3), offsets.reshape(-1, 3), tips.reshape(-1, 2), bases.reshape(-1, 3))


ELEVEN_PARTS = Anatomy("eleven-parts", TEN_PARTS.joints, TEN_PARTS.markers)


BODIES = [(TEN_PARTS, BDP), (FOURTEEN_PARTS, tapered(FOURTEEN_PARTS))]


@pytest.mark.parametrize(("anatomy", "bdp"), BODIES, ids=["cylinders", "tapered"])
def test_a_body_round_trips(anatomy: Anatomy, bdp: Bdp) -> None:
    """With tips and bases where the parts are tapered; the bytes of cylinders equal those of a version without them."""
    data = encode(TrackerBdp(frame=1, captured_ns=2, body=conversion.body_of(anatomy, bdp)))
    body = decode(data, TrackerBdp).body
    back = conversion.bdp_of(conversion.anatomy_of(body), body)
    for name in ("sizes", "offsets", "tips", "bases"):
        np.testing.assert_array_equal(getattr(back, name), getattr(bdp, name))
        assert (name.encode() in data) is (getattr(bdp, name) is not None)


INCOMPLETE = [{"sizes": "head", "offsets": "left_knee"}, {"tips": "head", "bases": "left_foot"}]


@pytest.mark.parametrize("without", INCOMPLETE, ids=["sizes and offsets", "tips and bases"])
def test_error_names_the_missing_part_and_joint(without: dict[str, str]) -> None:
    body = conversion.body_of(FOURTEEN_PARTS, tapered(FOURTEEN_PARTS))
    for field, name in without.items():
        del getattr(body, field)[name]
    with pytest.raises(ValueError, match=f"body: {', '.join(without.values())} missing"):
        conversion.bdp_of(FOURTEEN_PARTS, body)


def test_a_body_of_another_and_of_an_unknown_anatomy_is_refused() -> None:
    other = conversion.body_of(ELEVEN_PARTS, BDP)
    with pytest.raises(ValueError, match="body: anatomy is 'eleven-parts'; this service uses 'ten-parts'"):
        conversion.bdp_of(TEN_PARTS, other)
    with pytest.raises(ValueError, match="anatomy 'eleven-parts': allowed: ten-parts, fourteen-parts"):
        conversion.anatomy_of(other)


@given(ANGLES)
def test_angles_round_trip_by_name(angles: Floats) -> None:
    named = conversion.angles_by_name(TEN_PARTS, angles)
    assert set(named) == set(TEN_PARTS.angles)
    assert all(type(value) is float for value in named.values())
    np.testing.assert_array_equal(conversion.angles_of(TEN_PARTS, named, TEN_PARTS.neutral), angles)


def test_angles_missing_in_a_message_are_unchanged_and_unknown_ones_an_error() -> None:
    expected, others = TEN_PARTS.neutral.copy(), TEN_PARTS.neutral
    expected[TEN_PARTS.index["right_knee.x"]] = -0.4
    before = others.copy()
    np.testing.assert_array_equal(conversion.angles_of(TEN_PARTS, {"right_knee.x": -0.4}, others), expected)
    np.testing.assert_array_equal(others, before)
    with pytest.raises(ValueError, match=r"joint angle 'tail\.x' is not one of anatomy 'ten-parts'"):
        conversion.angles_of(TEN_PARTS, {"tail.x": 0.1}, others)


def scene_points(points: Floats) -> ScenePoints:
    message = ScenePoints(frame=1, captured_ns=2, points=conversion.packed_points(points))
    return decode(encode(message), ScenePoints)


@given(arrays(np.float64, st.tuples(st.integers(0, 30), st.just(3)), elements=st.floats(-32.7, 32.7)))
def test_scene_points_round_trip_within_a_millimetre(points: Floats) -> None:
    np.testing.assert_allclose(conversion.points_of(scene_points(points)), points, atol=0.00051)


def test_scene_points_out_of_range_or_above_the_maximum_number_are_omitted() -> None:
    far = np.array([[0.0, 1.0, 40.0], [1.0, 2.0, 3.0], [0.0, -32.768, 0.0]])
    np.testing.assert_allclose(conversion.points_of(scene_points(far)), [[1.0, 2.0, 3.0]])
    assert len(conversion.points_of(scene_points(np.zeros((MOST_POINTS + 1, 3))))) == MOST_POINTS


def test_an_incomplete_point_raises_an_error() -> None:
    with pytest.raises(ValueError, match="points: 7 bytes; allowed: a multiple of 6"):
        conversion.points_of(ScenePoints(frame=0, captured_ns=0, points=b"1234567"))


def test_a_camera_message_round_trips() -> None:
    found = conversion.camera_of(built(CameraInfo))
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
        conversion.camera_of(built(CameraInfo, **changes))
