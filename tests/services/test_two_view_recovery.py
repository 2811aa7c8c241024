"""After any false messages of the integrator and a viewer, the next T-pose starts tracking again."""

import random
from contextlib import suppress
from dataclasses import replace

import msgspec
import pytest

from tests.support import two_view_run
from tests.support.hostile import valid_messages
from zenocap.common import messages as m
from zenocap.common import topics
from zenocap.services.integrator import step as integrator
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.two_view import step as viewer

pytestmark = pytest.mark.slow

COUNT, EMPTY = 60, 10
TO_INTEGRATOR = (topics.PARTIAL_BDP, topics.SIGHTING, topics.PARTIAL_BAP, topics.HEALTH, topics.REQUEST)
TO_VIEWERS = (topics.UNIVERSAL_BDP, topics.ASSIGNMENT, topics.UNIVERSAL_BAP)
PER_TOPIC, MOST_AT_ONCE = 20, 7  # false messages on each topic; between two frames


class RepeatedTake:
    """The posture take from its T-pose on, repeated, with increasing time stamps."""

    def __init__(self, run: two_view_run.Run) -> None:
        self.run, self.frame = run, 0

    def play(self, first: int, messages: list[m.Message], rng: random.Random) -> None:
        for k in range(first, COUNT):
            for _ in range(min(rng.randint(0, MOST_AT_ONCE), len(messages))):
                deliver(self.run, messages.pop())
            self.run.process({id: self._now(frame) for id, frame in two_view_run.film(COUNT)[k].items()})
            self.frame += 1

    def _now(self, frame: Frame) -> Frame:
        return replace(frame, frame=self.frame, captured_ns=two_view_run.EPOCH_NS + self.frame * two_view_run.FRAME_NS)


def false_messages(seed: int) -> list[m.Message]:
    found = []
    for topic in TO_INTEGRATOR + TO_VIEWERS:
        for message in valid_messages(topic, PER_TOPIC, seed):
            names = {"viewer": "1", "id": "1", "service": "viewer"}
            mine = {name: value for name, value in names.items() if hasattr(message, name)}
            found.append(msgspec.structs.replace(message, **mine))
    random.Random(seed).shuffle(found)
    return found


def deliver(run: two_view_run.Run, message: m.Message) -> None:
    """Apply the step as the service loop does: a failed step keeps the state."""
    event = two_view_run.envelope(message)
    with suppress(ValueError):
        if event.topic in TO_INTEGRATOR:
            run.integrator, published = integrator.step(two_view_run.integrator_setup(), run.integrator, event)
            run.send_to_viewers(published)
            return
        for id in two_view_run.VIEWERS:
            run.viewers[id], published = viewer.step(two_view_run.viewer_setup(id), run.viewers[id], event)
            run.send_to_integrator(published)


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(4))
def test_the_next_initial_posture_restarts_tracking_after_false_messages(seed: int) -> None:
    run, rng = two_view_run.Run(), random.Random(seed)
    repeated_take = RepeatedTake(run)
    repeated_take.play(0, [], rng)
    assert two_view_run.messages_of_kind(run.published, m.UniversalBap)
    repeated_take.play(EMPTY, false_messages(seed), rng)
    run.integrator = replace(run.integrator, offsets={})  # corrected by the next health message
    for _ in range(2):
        repeated_take.play(EMPTY, [], rng)
    before = len(run.published)
    repeated_take.play(EMPTY, [], rng)
    assert len(two_view_run.messages_of_kind(run.published[before:], m.UniversalBap)) > COUNT / 2
