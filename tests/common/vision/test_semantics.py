"""Correction of a foreground by the result of a network: the decision of every pixel."""

import numpy as np

from zenocap.common.vision.foreground import BACKGROUND, STRONG, UNSURE, WEAK
from zenocap.common.vision.semantics import KEEP, LONGEST_NS, NOT_PERSON, PERSON, Semantics, decision, overrule, verdicts

NOISE = 1.0


def found(left: int = 0, top: int = 0) -> Semantics:
    """Of a grey crop of 4 x 6 px: a column of each verdict, twice."""
    verdict = np.tile(np.array([KEEP, NOT_PERSON, PERSON], np.uint8), (4, 2))
    return Semantics(1000, left, top, np.full((4, 6, 3), 100, np.uint8), verdict)


def test_the_middle_of_a_person_is_sure_and_the_edge_is_kept() -> None:
    person = np.zeros((100, 100), np.float32)
    person[30:70, 40:60] = 1.0
    result = verdicts(person)
    assert result[50, 50] == PERSON
    assert result[50, 40] == result[50, 39] == KEEP
    assert result[5, 5] == NOT_PERSON
    assert (result[person == 0] != PERSON).all()


def test_what_the_network_takes_for_a_person_in_the_empty_room_too_is_no_sure_person() -> None:
    person = np.ones((40, 40), np.float32)
    assert (verdicts(person, person) == KEEP).all()
    assert (verdicts(person, np.zeros_like(person)) == PERSON).all()


def test_an_unsure_network_decides_nothing() -> None:
    assert (verdicts(np.full((40, 40), 0.5, np.float32)) == KEEP).all()


def test_a_verdict_counts_where_the_image_is_unchanged() -> None:
    frame = np.full((10, 10, 3), 100, np.uint8)
    frame[2, :, 1] = 140  # one row of the crop has another green
    decided = decision(found(2, 1), frame, 1000, NOISE)
    assert (decided[1, 2:8] == found().verdict[0]).all()
    assert (decided[2] == KEEP).all()
    assert (decided[:, :2] == KEEP).all()
    assert (decided[5:] == KEEP).all()


def test_a_result_that_is_too_old_or_of_a_later_frame_decides_nothing() -> None:
    frame = np.full((10, 10, 3), 100, np.uint8)
    assert decision(found(), frame, 1000 + LONGEST_NS, NOISE) is not None
    assert decision(found(), frame, 1001 + LONGEST_NS, NOISE) is None
    assert decision(found(), frame, 999, NOISE) is None
    assert decision(None, frame, 1000, NOISE) is None


def test_overruling_leaves_what_is_kept() -> None:
    labels = np.array([[BACKGROUND, UNSURE, WEAK, STRONG]] * 3, np.uint8)
    before = labels.copy()
    overrule(labels, np.array([[KEEP] * 4, [NOT_PERSON] * 4, [PERSON] * 4], np.uint8))
    assert (labels[0] == before[0]).all()
    assert (labels[1] == BACKGROUND).all()
    assert (labels[2] == STRONG).all()
