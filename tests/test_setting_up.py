"""What is said of a silhouette while setting up."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from services.animator.setting_up import Verdict, findings, shape_of

Mask = NDArray[np.uint8]


def person(left: int = 60, top: int = 20, width: int = 40, height: int = 90) -> Mask:
    """A block of a person in a picture of 160 x 120."""
    mask = np.zeros((120, 160), np.uint8)
    mask[max(top, 0) : top + height, max(left, 0) : left + width] = 1
    return mask


def verdicts(mask: Mask, seen_as: object = None) -> dict[str, Verdict]:
    assert seen_as in (None, "front", "side")
    return {name: verdict for name, verdict, _ in findings(shape_of(mask), seen_as)}  # type: ignore[arg-type]


def words(mask: Mask, name: str) -> str:
    return next(words for one, _, words in findings(shape_of(mask), None) if one == name)


def test_nobody_is_asked_into_the_view() -> None:
    assert findings(shape_of(np.zeros((120, 160), np.uint8)), "front") == [("person", "wait", "step into the view")]


def test_a_whole_large_clean_person_is_good() -> None:
    assert verdicts(person()) == {"in view": "good", "size": "good", "silhouette": "good"}


@pytest.mark.parametrize(
    ("mask", "side"),
    [(person(left=0), "left"), (person(left=120), "right"), (person(top=0), "upper"), (person(top=30), "feet")],
)
def test_who_is_cut_is_told_where(mask: Mask, side: str) -> None:
    assert verdicts(mask)["in view"] == "bad"
    assert side in words(mask, "in view")


def test_a_small_person_is_asked_to_come_closer() -> None:
    assert "come closer" in words(person(height=35), "size")
    assert "step back" in words(person(top=1, height=118), "size")


def test_holes_and_frayed_edges_are_told_apart() -> None:
    holes = person()
    holes[40:52, 70:82] = 0
    assert "holes" in words(holes, "silhouette")
    frayed = person()
    frayed[20:110:2, 100:112] = 1
    assert "frayed" in words(frayed, "silhouette")


@pytest.mark.parametrize(("width", "front", "side"), [(90, "good", "bad"), (40, "bad", "good"), (57, "bad", "bad")])
def test_the_initial_posture_is_judged_by_the_side_that_is_seen(width: int, front: Verdict, side: Verdict) -> None:
    mask = person(left=30, width=width)
    assert verdicts(mask, "front")["posture"] == front
    assert verdicts(mask, "side")["posture"] == side
    assert "posture" not in verdicts(mask)


@given(left=st.integers(1, 110), top=st.integers(1, 25))
def test_where_a_person_stands_does_not_matter_while_in_view(left: int, top: int) -> None:
    assert verdicts(person(left, top)) == verdicts(person())


@given(st.integers(0, 2**31))
def test_any_mask_gets_findings(seed: int) -> None:
    mask = (np.random.default_rng(seed).random((24, 32)) < 0.5).astype(np.uint8)
    shape = shape_of(mask)
    assert 0 <= shape.frayed <= 1
    assert shape.holes >= 0
    assert all(said for _, _, said in findings(shape, "front"))
