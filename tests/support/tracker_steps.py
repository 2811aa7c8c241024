"""The tracker's step, message by message."""

from collections.abc import Iterable

from tests.support.two_view_run import envelope
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Tick
from zenocap.services.tracker import step as tracker
from zenocap.services.tracker.states import TrackerSetup, TrackerState


def pass_to(
    setup: TrackerSetup, state: TrackerState | None, messages: Iterable[m.Message]
) -> tuple[TrackerState, list[m.Message]]:
    """State after the messages, and what was published; frame sets stay queued."""
    state, published = state or tracker.initial_state(setup), list[m.Message]()
    for message in messages:
        state, more = tracker.step(setup, state, envelope(message))
        published += more
    return state, published


def track_queued(setup: TrackerSetup, state: TrackerState) -> tuple[TrackerState, list[m.Message]]:
    published: list[m.Message] = []
    while tracker.pending(state):
        state, more = tracker.step(setup, state, Tick(1))
        published += more
    return state, published


def track_each(
    setup: TrackerSetup, state: TrackerState | None, messages: Iterable[m.Message]
) -> tuple[TrackerState, list[m.Message]]:
    """As `pass_to`, with every frame set tracked before the next message."""
    state, published = state or tracker.initial_state(setup), list[m.Message]()
    for message in messages:
        state, more = pass_to(setup, state, [message])
        state, poses = track_queued(setup, state)
        published += more + poses
    return state, published
