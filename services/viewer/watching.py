"""The viewer's step where the tracker does the rest: pictures in, a silhouette of each out, empty ones too.

It measures no body, searches no limbs and listens to nobody.
"""

from dataclasses import dataclass

from common.bus.protocol import Alive, Envelope, Tick
from common.messages import Message
from services.viewer.frame import Frame, Masked
from services.viewer.seeing import learn, see, silhouette_message
from services.viewer.states import LearningBackground, Seen, Setup

Event = Frame | Masked | Envelope | Alive | Tick


@dataclass(frozen=True)
class Watching:
    """present: whether somebody was in the last frame."""

    seen: Seen
    present: bool = False


State = LearningBackground | Watching


def initial_state(setup: Setup) -> State:
    return LearningBackground()


def step(setup: Setup, state: State, event: Event) -> tuple[State, list[Message]]:
    """One event.  Pure: the state and the messages depend on the arguments alone."""
    match state, event:
        case LearningBackground(), Frame(image=image):
            state, seen = learn(setup, state, image)
            return (state if seen is None else Watching(seen)), []
        case Watching(seen=seen), Frame():
            seen, mask, messages = see(setup, seen, event)
            return Watching(seen, mask is not None), [*messages, silhouette_message(setup, event, mask)]
        case _:
            return state, []


def describe(state: State) -> str:
    """What the viewer is doing, for its health."""
    match state:
        case LearningBackground(frames=frames):
            return f"learning the background ({len(frames)} frames)"
        case Watching(present=present):
            return "silhouettes only" + ("" if present else ", nobody in view")
