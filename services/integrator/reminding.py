"""A viewer that sees the person and says nothing of its limbs does not know the body: it is said again."""

from dataclasses import replace

from common.messages import Message, Sighting
from common.pairing import Instant
from services.integrator.states import State

SILENT_NS = 2_000_000_000  # of a viewer before it is reminded, and between two reminders


def answered(state: State, viewer: str, captured_ns: int) -> State:
    """A viewer said where the limbs are at that time."""
    if viewer not in state.sightings.viewers:
        return state
    return replace(state, answered={**state.answered, viewer: captured_ns})


def remind(state: State, instant: Instant[Sighting]) -> tuple[State, list[Message]]:
    """The universal body once more, if one who sees the person in this instant has long been silent."""
    body = state.said
    if state.person is None or body is None:
        return state, []
    now_ns = instant.captured_ns
    seeing = {viewer: state.answered.get(viewer, now_ns) for viewer, sight in instant.items.items() if sight.present}
    silent = {viewer: now_ns for viewer, last_ns in seeing.items() if abs(now_ns - last_ns) > SILENT_NS}
    state = replace(state, answered={**state.answered, **seeing, **silent})
    return state, [body] if silent else []
