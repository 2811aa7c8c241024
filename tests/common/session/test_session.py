"""Session: frame sets to quiet in a fixed order, steps ahead, failures."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import pytest

from tests.common.bus.test_inbox import bap, sighting
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Envelope
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.runtime.service import Event, Service, TopicSubscription
from zenocap.common.session.session import Session
from zenocap.common.topics import HANDLED, SIGHTING, UNIVERSAL_BAP, Topic

START_NS = 1_700_000_000_000_000_000
FAILING = 3  # frame on which the viewers' step fails


@dataclass(frozen=True)
class Image:
    frame: int
    captured_ns: int


def viewer(id: str, *answers: Topic) -> Service[str, int, Image]:
    """Counts its frames; publishes one sighting each.  answers: topics that it receives."""

    def step(setup: str, state: int, event: Event[Image]) -> tuple[int, Sequence[m.Message]]:
        if not isinstance(event, Image):
            return state, []
        if event.frame == FAILING:
            raise RuntimeError("no person")
        return state + 1, [sighting(setup, state)]

    return Service(
        "viewer", id, id, lambda: 0, step, tuple(map(TopicSubscription, answers)), lambda count: f"{count} frames"
    )


def integrator() -> Service[None, int, Image]:
    """Publishes a pose with the number of sightings so far, once both viewers have sent one more."""

    def step(setup: None, state: int, event: Event[Image]) -> tuple[int, Sequence[m.Message]]:
        if isinstance(event, Envelope) and isinstance(event.message, m.Sighting):
            return state + 1, [bap(state + 1)] if state % 2 else []
        return state, []

    return Service("integrator", "main", None, lambda: 0, step, (TopicSubscription(SIGHTING, every=True),))


def session(*answers: Topic) -> Session[Image]:
    services = [integrator(), viewer("2", *answers), viewer("1", *answers)]
    return Session("studio", ManualClock(START_NS), services, (SIGHTING, UNIVERSAL_BAP, HANDLED))


def frame_sets(count: int) -> Iterator[dict[str, Image]]:
    for k in range(count):
        yield {id: Image(k, START_NS + k * 1_000_000) for id in ("1", "2")}


def kinds(received: Sequence[Envelope]) -> list[tuple[str, int]]:
    return [(one.topic.name, one.message.frame) for one in received]


def test_a_frame_set_is_handled_until_no_message_is_left() -> None:
    found = session()
    (first,) = frame_sets(1)
    received = found.frames(first)
    assert kinds(received) == [("sighting", 0), ("sighting", 0), ("universal_bap", 2)]
    assert [one.message.viewer for one in received[:2] if isinstance(one.message, m.Sighting)] == ["2", "1"]
    assert {one.received_ns for one in received} == {first["1"].captured_ns}


@pytest.mark.parametrize("answers", [(), (UNIVERSAL_BAP,)], ids=["ahead", "with answers"])
def test_steps_ahead_give_equal_messages(answers: tuple[Topic, ...]) -> None:
    plain, ahead = session(*answers), session(*answers)
    sets = list(frame_sets(6))
    sources = {id: ahead.ahead(id, iter([one[id] for one in sets])) for id in ("1", "2")}
    stepped = list(zip(*sources.values(), strict=True))  # all of them before the first is fed
    for one, (first, second) in zip(sets, stepped, strict=True):
        assert kinds(ahead.frames({"1": first, "2": second})) == kinds(plain.frames(one))
    assert ahead.states() == plain.states() == {"viewer 2": "5 frames", "viewer 1": "5 frames", "integrator": "int"}
    assert ahead.failures() == plain.failures()


def test_a_failing_step_is_counted_and_keeps_the_state_before() -> None:
    found = session()
    for one in frame_sets(6):
        found.frames(one)
    assert found.failures()["steps failed"] == 2
    assert found.describe(("viewer", "1")) == "5 frames"


def test_input_traces_are_those_of_the_viewers_first() -> None:
    found = session()
    for one in frame_sets(2):
        found.frames(one)
    assert kinds(found.report(("integrator", "main"))) == [("handled", 0)]
    traces = [one.message for one in found.report() if isinstance(one.message, m.Handled)]
    assert [(one.service, one.id) for one in traces] == [("viewer", "2"), ("viewer", "1")]


def test_a_recorded_message_is_handled_at_its_time() -> None:
    made = session().frames(next(frame_sets(1)))
    again = Session("studio", ManualClock(START_NS), [integrator()], (UNIVERSAL_BAP,))
    received = [pose for one in made if one.topic is SIGHTING for pose in again.replay(one)]
    assert kinds(received) == [("universal_bap", 2)]
