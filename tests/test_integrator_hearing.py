"""What fits no body is refused before it waits for its pair; who knows no body is told again."""

import msgspec
import pytest
from perfect_viewers import BEGINNING, FIRST, TRACKED, partial_bap, partial_bdp, play, sighting
from two_view_run import FRAME_NS

from common import messages as m
from common.body.anatomy import TEN_PARTS
from services.integrator.reminding import SILENT_NS

BODY = BEGINNING[-2]
POSE = TEN_PARTS.neutral
LONG = SILENT_NS // FRAME_NS + 2  # frames


def test_joint_angles_of_another_body_are_refused_and_the_next_are_taken() -> None:
    state, _ = play(TRACKED, sighting("1", FIRST), sighting("2", FIRST))
    strange = msgspec.structs.replace(partial_bap("1", FIRST, POSE), angles={"tail.x": 0.1})
    with pytest.raises(ValueError, match=r"joint angle 'tail\.x' is not one of anatomy 'ten-parts'"):
        play(state, strange)
    _, said = play(state, partial_bap("1", FIRST, POSE), partial_bap("2", FIRST, POSE))
    assert [type(message) for message in said] == [m.UniversalBap]


@pytest.mark.parametrize(
    "lengths", [{}, {"height": 1.8}, {"tail": 1.0}, {"height": 0.0, "torso_depth": 0.2, "head_depth": 0.2}]
)
def test_lengths_of_no_person_are_refused(lengths: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=r"of the side, metres: .*; expected above 0: height, torso_depth, head_depth"):
        play(TRACKED, msgspec.structs.replace(partial_bdp("2", FIRST), lengths=lengths))


def reminders(silent: str, frames: int) -> int:
    """How often the body is said again to two viewers that see the person, one of them without saying how it stands."""
    state, count = TRACKED, 0
    for frame in range(FIRST, FIRST + frames):
        baps = [partial_bap(viewer, frame, POSE) for viewer in ("1", "2") if viewer != silent]
        state, said = play(state, sighting("1", frame), sighting("2", frame), *baps)
        count += sum(message == BODY for message in said)
    return count


def test_a_viewer_that_does_not_know_the_body_is_told_again_and_not_at_every_frame() -> None:
    assert reminders("2", LONG) == 1
    assert reminders("2", 2 * LONG) == 2
    assert reminders("nobody", 2 * LONG) == 0


def test_a_viewer_that_sees_nobody_need_not_answer() -> None:
    state = TRACKED
    for frame in range(FIRST, FIRST + 2 * LONG):
        seen = (sighting("1", frame), sighting("2", frame, present=False), partial_bap("1", frame, POSE))
        state, said = play(state, *seen)
        assert BODY not in said


def test_strangers_are_not_remembered() -> None:
    state = TRACKED
    for number in range(20):
        state, _ = play(state, msgspec.structs.replace(partial_bap("1", FIRST, POSE), viewer=f"stranger{number}"))
    assert set(state.answered) <= {"1", "2"}
