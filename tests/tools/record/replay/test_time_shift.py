"""Messages shifted to a later time: valid, equal in all else, with unchanged time differences."""

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.message_strategies import messages_of
from zenocap.common import messages as m
from zenocap.common.codec import decode, encode
from zenocap.common.topics import TOPICS
from zenocap.tools.record.replay.time_shift import ReplayProgress, Shift, continued, shifted

SMALL = st.integers(min_value=0, max_value=2**40)
SHIFTS = st.builds(Shift, SMALL, st.integers(min_value=0, max_value=2**40))
ANY = st.sampled_from(TOPICS).flatmap(lambda topic: messages_of(topic.message))


def early(message: m.Message) -> m.Message:
    """The same message with times and frames that leave room for a shift."""
    changes: dict[str, object] = {"captured_ns": message.captured_ns % 2**60, "frame": message.frame % 2**40}
    match message:
        case m.Sighting(based_on=based_on) | m.PartialBap(based_on=based_on):
            changes["based_on"] = based_on % 2**40 if based_on >= 0 else -1
        case m.Assignment(views=views):
            changes["views"] = {v: msgspec.structs.replace(view, frame=view.frame % 2**40) for v, view in views.items()}
    return msgspec.structs.replace(message, **changes)


@pytest.mark.nightly
@given(ANY.map(early), SHIFTS)
def test_a_shifted_message_is_valid_and_later_by_the_shift(message: m.Message, shift: Shift) -> None:
    later = shifted(message, shift)
    assert decode(encode(later), type(later)) == later
    assert (later.captured_ns - message.captured_ns, later.frame - message.frame) == (shift.time_ns, shift.frames)


@pytest.mark.nightly
@given(ANY.map(early), SHIFTS)
def test_shifting_back_restores_the_message(message: m.Message, shift: Shift) -> None:
    assert shifted(shifted(message, shift), Shift(-shift.time_ns, -shift.frames)) == message


@pytest.mark.slow
@given(messages_of(m.Sighting).map(early), messages_of(m.Assignment).map(early), SHIFTS)
def test_shifted_assignment_refers_to_the_shifted_sighting(sighting, answer, shift):
    answered = {"1": m.ViewAssignment(frame=sighting.frame, view="flank", scale=1.0, stale=False)}
    answer = msgspec.structs.replace(answer, views=answered)
    later, reply = shifted(sighting, shift), shifted(answer, shift)
    assert reply.views["1"].frame == later.frame
    assert later.based_on == (-1 if sighting.based_on < 0 else sighting.based_on - sighting.frame + later.frame)


POSITIONS = st.integers(min_value=0, max_value=10**13)


@given(SHIFTS, POSITIONS, POSITIONS, SMALL, st.integers(1, 10**9))
def test_message_after_a_jump_back_is_later_by_the_gap(shift: Shift, at: int, to: int, frame: int, gap: int) -> None:
    reached = ReplayProgress(at + shift.time_ns, frame + shift.frames, at)
    new = continued(shift, reached, to, 0, gap)
    if to > at:
        assert new == shift
    else:
        assert to + new.time_ns == reached.captured_ns + gap
        assert 0 + new.frames > reached.frame


def test_default_shift_is_zero() -> None:
    assert not Shift()
    assert Shift(1)
    assert Shift(0, 1)
