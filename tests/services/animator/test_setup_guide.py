"""Set-up checks of a silhouette."""

from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from zenocap.common.arrays import Mask
from zenocap.services.animator.setup_guide import Verdict, measure_silhouette, silhouette_findings


def person(left: int = 60, top: int = 20, width: int = 40, height: int = 90) -> Mask:
    """A rectangle as the silhouette, image 160 x 120."""
    mask = np.zeros((120, 160), np.uint8)
    mask[max(top, 0) : top + height, max(left, 0) : left + width] = 1
    return mask


def damaged(rows: slice, columns: slice, value: int) -> Mask:
    mask = person()
    mask[rows, columns] = value
    return mask


def verdicts(mask: Mask, side: Literal["front", "side"] | None = None) -> dict[str, Verdict]:
    return {name: verdict for name, verdict, _ in silhouette_findings(measure_silhouette(mask), side)}


def test_an_empty_view_asks_the_person_to_step_in() -> None:
    empty = measure_silhouette(np.zeros((120, 160), np.uint8))
    assert silhouette_findings(empty, "front") == [("person", "wait", "step into the view")]


def test_a_whole_large_clean_person_is_good() -> None:
    assert verdicts(person()) == {"in view": "good", "size": "good", "silhouette": "good"}


@pytest.mark.parametrize(
    ("mask", "check", "words"),
    [
        (person(left=0), "in view", "left"),
        (person(left=120), "in view", "right"),
        (person(top=0), "in view", "upper"),
        (person(top=30), "in view", "feet"),
        (person(height=35), "size", "come closer"),
        (person(top=1, height=118), "size", "step back"),
        (damaged(slice(40, 52), slice(70, 82), 0), "silhouette", "holes"),
        (damaged(slice(20, 110, 2), slice(100, 112), 1), "silhouette", "frayed"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_bad_silhouette_has_advice(mask: Mask, check: str, words: str) -> None:
    findings = {name: (verdict, text) for name, verdict, text in silhouette_findings(measure_silhouette(mask), None)}
    verdict, text = findings[check]
    assert verdict == "bad"
    assert words in text


@pytest.mark.parametrize(("width", "front", "side"), [(90, "good", "bad"), (40, "bad", "good"), (57, "bad", "bad")])
def test_the_initial_posture_is_checked_by_the_side_of_the_view(width: int, front: Verdict, side: Verdict) -> None:
    mask = person(left=30, width=width)
    assert verdicts(mask, "front")["posture"] == front
    assert verdicts(mask, "side")["posture"] == side
    assert "posture" not in verdicts(mask)


@given(left=st.integers(1, 110), top=st.integers(1, 25))
def test_the_position_in_the_view_does_not_matter(left: int, top: int) -> None:
    assert verdicts(person(left, top)) == verdicts(person())


@given(st.integers(0, 2**31))
def test_any_mask_gets_findings(seed: int) -> None:
    mask = (np.random.default_rng(seed).random((24, 32)) < 0.5).astype(np.uint8)
    shape = measure_silhouette(mask)
    assert 0 <= shape.frayed <= 1
    assert shape.holes >= 0
    assert all(text for _, _, text in silhouette_findings(shape, "front"))
