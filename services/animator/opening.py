"""The first pose of a take, which the page shows while the replay starts."""

from collections.abc import Collection
from dataclasses import replace
from itertools import islice
from pathlib import Path

from zenocap.common.bus.protocol import Tick
from zenocap.common.codec import BadMessage
from zenocap.common.errors import UserError
from zenocap.common.recording.reader import TakeReader, envelope
from zenocap.common.topics import Topic, topic_at
from zenocap.services.animator.parameters import MAX_OPENING_MESSAGES
from zenocap.services.animator.states import AnimatorSetup, AnimatorState
from zenocap.services.animator.step import step


def opening_state(path: Path, topics: Collection[Topic], now_ns: int) -> AnimatorState:
    """State after the messages of `topics` up to the first pose of a person, as if received at `now_ns`.

    Without actors when no person is found in the first MAX_OPENING_MESSAGES messages, or the file is damaged before.
    """
    setup, state = AnimatorSetup(), AnimatorState()
    try:
        for recorded in islice(TakeReader(path).messages(), MAX_OPENING_MESSAGES):
            topic = topic_at(recorded.topic)
            if topic is None or topic not in topics:
                continue
            try:
                received = envelope(recorded)
            except BadMessage:  # counted by the replay
                continue
            if received is not None:
                state, _ = step(setup, state, replace(received, received_ns=now_ns))
            if any("person" not in actor.lost for actor in state.actors.values()):
                return step(setup, state, Tick(now_ns))[0]
    except (OSError, UserError):  # the replay reports it
        pass
    return replace(state, actors={})
