"""Whatever was said in the integrator's and a viewer's names, the next initial posture begins the tracking again."""

import random
from contextlib import suppress
from dataclasses import replace

import msgspec
import pytest
from hostile import valid_messages
from two_view_run import EPOCH_NS, FRAME_NS, VIEWERS, Run, envelope, film, integrator_setup, kind_of, viewer_setup

from common import messages as m
from common import topics
from services.integrator import step as integrator
from services.viewer import step as viewer
from services.viewer.sources.frame import Frame

COUNT, EMPTY = 60, 10
TO_INTEGRATOR = (topics.PARTIAL_BDP, topics.SIGHTING, topics.PARTIAL_BAP, topics.HEALTH, topics.REQUEST)
TO_VIEWERS = (topics.UNIVERSAL_BDP, topics.ASSIGNMENT, topics.UNIVERSAL_BAP)
EACH, MOST_AT_ONCE = 20, 7  # lies on each topic; between two frames


class Film:
    """The posture take from its initial posture on, again and again, while time goes on."""

    def __init__(self, run: Run) -> None:
        self.run, self.frame = run, 0

    def play(self, first: int, lies: list[m.Message], rng: random.Random) -> None:
        for k in range(first, COUNT):
            for _ in range(min(rng.randint(0, MOST_AT_ONCE), len(lies))):
                tell(self.run, lies.pop())
            self.run.see({id: self._now(frame) for id, frame in film(COUNT)[k].items()})
            self.frame += 1

    def _now(self, frame: Frame) -> Frame:
        return replace(frame, frame=self.frame, captured_ns=EPOCH_NS + self.frame * FRAME_NS)


def lies_of(seed: int) -> list[m.Message]:
    found = []
    for topic in TO_INTEGRATOR + TO_VIEWERS:
        for message in valid_messages(topic, EACH, seed):
            names = {"viewer": "1", "id": "1", "service": "viewer"}
            mine = {name: value for name, value in names.items() if hasattr(message, name)}
            found.append(msgspec.structs.replace(message, **mine))
    random.Random(seed).shuffle(found)
    return found


def tell(run: Run, lie: m.Message) -> None:
    """As the service loop does: a step that fails leaves the state as it was."""
    event = envelope(lie)
    with suppress(ValueError):
        if event.topic in TO_INTEGRATOR:
            run.integrator, said = integrator.step(integrator_setup(), run.integrator, event)
            run.tell_viewers(said)
            return
        for id in VIEWERS:
            run.viewers[id], said = viewer.step(viewer_setup(id), run.viewers[id], event)
            run.tell_integrator(said)


@pytest.mark.parametrize("seed", range(4))
def test_the_next_initial_posture_begins_again_whatever_was_said(seed: int) -> None:
    run, rng = Run(), random.Random(seed)
    played = Film(run)
    played.play(0, [], rng)
    assert kind_of(run.said, m.UniversalBap)
    played.play(EMPTY, lies_of(seed), rng)
    run.integrator = replace(run.integrator, offsets={})  # what the next health sets right
    for _ in range(2):
        played.play(EMPTY, [], rng)
    before = len(run.said)
    played.play(EMPTY, [], rng)
    assert len(kind_of(run.said[before:], m.UniversalBap)) > COUNT / 2
