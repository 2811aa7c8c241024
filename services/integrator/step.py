"""The integrator's step: sightings, partial BDPs and BAPs in; assignments, universal BDP and BAP out.  [Two-view 4]"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias, TypeVar

from common.bus.protocol import Alive, Envelope, FrameLike, Tick
from common.messages import Health, Message, PartialBap, PartialBdp, Request, Sighting, UniversalBap, UniversalBdp
from common.pairing import Instant, Pairs, offer
from common.runtime.clock import Offset, clock_warning, offset_in, to_integrator_ns
from services.integrator.arbitrator import View
from services.integrator.hearing import check
from services.integrator.measuring import define_body, place_first
from services.integrator.placing import place_person
from services.integrator.posing import pose_person
from services.integrator.reminding import answered, remind
from services.integrator.resuming import resume
from services.integrator.states import INSTANTS_OF_BODY, Setup, State, integrator_setup

__all__ = ["counts", "describe", "initial_state", "integrator_setup", "step"]

Event = FrameLike | Envelope | Alive | Tick  # the loop's; the integrator has no frames
Result: TypeAlias = tuple[State, list[Message]]
T = TypeVar("T")


def initial_state(setup: Setup) -> State:
    viewers = tuple(setup.cameras)
    tolerance = setup.frame_ns // 2
    views: dict[str, View] = {viewers[0]: "facade", viewers[1]: "flank"}
    return State(Pairs(viewers, tolerance), Pairs(viewers, tolerance), Pairs(viewers, tolerance), views)


def step(setup: Setup, state: State, event: Event) -> Result:
    """One event.  Pure: the state and the messages depend on the arguments alone."""
    if not isinstance(event, Envelope):
        return state, []
    message = event.message
    match message:
        case Sighting(viewer=viewer):
            pairs, sightings = offer(state.sightings, viewer, _time(state, message), message)
            return _each(setup, replace(state, sightings=pairs), sightings, _assign)
        case PartialBdp(viewer=viewer):
            check(setup.anatomy, message)
            bdps, pairs_of_bdps = offer(state.bdps, viewer, _time(state, message), message)
            return _each(setup, replace(state, bdps=bdps), pairs_of_bdps, define_body)
        case PartialBap(viewer=viewer):
            check(setup.anatomy, message)
            baps, pairs_of_baps = offer(state.baps, viewer, _time(state, message), message)
            state = answered(replace(state, baps=baps), viewer, _time(state, message))
            return _each(setup, state, pairs_of_baps, pose_person)
        case Health(service="viewer", id=viewer) if viewer in setup.cameras:
            return _set_clock(setup, state, viewer, offset_in(message)), []
        case UniversalBdp() | UniversalBap() if knows_nobody(state):
            return resume(setup, state, message)
        case Request(what="measure"):
            return measure_again(state), []
        case _:
            return state, []


def knows_nobody(state: State) -> bool:
    """Whether this integrator would hear what the one before it had said, and has not been told to forget it."""
    return state.person is None and not state.anew


def describe(state: State) -> str:
    """What the integrator is doing, for its health."""
    if state.person is None:
        measured = f"measuring the body ({len(state.bodies)} of {INSTANTS_OF_BODY})" if state.bodies else ""
        return state.problem or measured or "waiting for the initial posture in both views"
    gone = [viewer for viewer in state.sightings.viewers if state.sightings.missed.get(viewer, 0) > 2]
    warnings = "".join(f"; {warning}" for warning in state.warnings.values())
    return "tracking" + (f", without viewer {' and '.join(gone)}" if gone else "") + warnings


def counts(state: State) -> Mapping[str, int]:
    """Sightings and partial BAPs that were late, doubled, out of order, unknown or went on alone."""
    kinds = (("sighting", state.sightings.counts), ("bap", state.baps.counts), ("bdp", state.bdps.counts))
    return {f"{name}_{what}": count for name, kind in kinds for what, count in kind.items()}


def measure_again(state: State) -> State:
    """Nobody is known any more; the next assignments tell the viewers so, and they measure the initial posture."""
    return replace(
        state, person=None, first=None, bodies=(), last={}, problem="", asked_ns=0, said=None, answered={}, anew=True,
    )  # fmt: skip


def _set_clock(setup: Setup, state: State, viewer: str, offset: Offset | None) -> State:
    """Remember a viewer's clock, and what to tell the person about it."""
    if offset is None:
        return state
    warning = clock_warning(viewer, offset, setup.frame_ns)
    others = {other: text for other, text in state.warnings.items() if other != viewer}
    warnings = {**others, viewer: warning} if warning else others
    return replace(state, offsets={**state.offsets, viewer: offset}, warnings=warnings)


def _time(state: State, message: Sighting | PartialBdp | PartialBap) -> int:
    """Capture time on this clock."""
    offset = state.offsets.get(message.viewer)
    return to_integrator_ns(message.captured_ns, offset) if offset else message.captured_ns


def _each(
    setup: Setup, state: State, instants: Sequence[Instant[T]], act: Callable[[Setup, State, Instant[T]], Result]
) -> Result:
    messages: list[Message] = []
    for instant in instants:
        state, more = act(setup, state, instant)
        messages += more
    return state, messages


def _assign(setup: Setup, state: State, instant: Instant[Sighting]) -> Result:
    state = replace(state, last={**state.last, **{v: s for v, s in instant.items.items() if s.present}})
    if state.person is None:
        return place_first(setup, state, instant)
    state, reminder = remind(state, instant)
    state, messages = place_person(setup, state, instant)
    return state, [*reminder, *messages]
