"""Messages that fit no body are rejected before pairing."""

import pytest
from msgspec.structs import replace

from tests.support.perfect_viewers import FIRST, INITIAL_MESSAGES, TRACKED, partial_bap, partial_bdp, play, sighting
from tests.support.two_view_run import FRAME_NS
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.services.integrator.parameters import REMINDER_NS

BODY = INITIAL_MESSAGES[-2]
POSE = TEN_PARTS.neutral
LONG = REMINDER_NS // FRAME_NS + 2  # frames


def test_joint_angles_of_another_anatomy_are_refused_and_the_next_ones_accepted() -> None:
    state, _ = play(TRACKED, sighting("1", FIRST), sighting("2", FIRST))
    with pytest.raises(ValueError, match=r"joint angle 'tail\.x' is not one of anatomy 'ten-parts'"):
        play(state, replace(partial_bap("1", FIRST, POSE), angles={"tail.x": 0.1}))
    _, published = play(state, partial_bap("1", FIRST, POSE), partial_bap("2", FIRST, POSE))
    assert [type(message) for message in published] == [m.UniversalBap]


@pytest.mark.parametrize(
    "lengths", [{}, {"height": 1.8}, {"tail": 1.0}, {"height": 0.0, "torso_depth": 0.2, "head_depth": 0.2}]
)
def test_implausible_lengths_are_refused(lengths: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=r"of the side, metres: .*; expected above 0: height, torso_depth, head_depth"):
        play(TRACKED, replace(partial_bdp("2", FIRST), lengths=lengths))


def repeated_bodies(silent: str, frames: int) -> int:
    """Number of repeated bodies for two viewers that see the person, one of which publishes no partial BAP."""
    state, count = TRACKED, 0
    for frame in range(FIRST, FIRST + frames):
        baps = [partial_bap(viewer, frame, POSE) for viewer in ("1", "2") if viewer != silent]
        state, published = play(state, sighting("1", frame), sighting("2", frame), *baps)
        count += sum(message == BODY for message in published)
    return count


@pytest.mark.slow
def test_the_body_is_repeated_at_intervals_for_a_viewer_without_partial_baps() -> None:
    assert repeated_bodies("2", LONG) == 1
    assert repeated_bodies("2", 2 * LONG) == 2
    assert repeated_bodies("none", 2 * LONG) == 0


def test_the_body_is_not_repeated_for_a_viewer_without_a_person_in_view() -> None:
    state = TRACKED
    for frame in range(FIRST, FIRST + 2 * LONG):
        seen = (sighting("1", frame), sighting("2", frame, present=False), partial_bap("1", frame, POSE))
        state, published = play(state, *seen)
        assert BODY not in published


def test_unknown_viewers_are_not_stored() -> None:
    one = partial_bap("1", FIRST, POSE)
    state, _ = play(TRACKED, *(replace(one, viewer=f"unknown{number}") for number in range(20)))
    assert set(state.answered) <= {"1", "2"}
