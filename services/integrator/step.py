"""Step of the integrator: sightings and partial results in, assignments and BAP out.  [Two-view 4]"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TypeAlias, TypeVar

from zenocap.common import messages as m
from zenocap.common.body.proportions import FRONT_LENGTHS, PAPER_FRONT_LENGTHS, PAPER_SIDE_LENGTHS, SIDE_LENGTHS
from zenocap.common.bus.protocol import Alive, Envelope, FrameLike, Tick
from zenocap.common.conversion import angles_of
from zenocap.common.runtime.clock_offset import Offset, clock_warning, offset_in, to_integrator_ns
from zenocap.common.runtime.frame_rate import holds_from_ns, share_of
from zenocap.common.synchronizer import FrameSet, Synchronizer, push, with_spacing
from zenocap.services.integrator import rate_control
from zenocap.services.integrator.parameters import INSTANTS_OF_BODY
from zenocap.services.integrator.rate_reports import Instants, report, with_instants
from zenocap.services.integrator.state_recovery import contradict_body, note_answer, note_body, republish_body, resume
from zenocap.services.integrator.states import IntegratorSetup, IntegratorState
from zenocap.services.integrator.two_view.arbitrator import View
from zenocap.services.integrator.two_view.fusion import pose_person
from zenocap.services.integrator.two_view.initialization import assign_first, define_body
from zenocap.services.integrator.two_view.root_pose import assign_pose

Event = FrameLike | Envelope | Alive | Tick  # of the service loop; the integrator has no frames
Result: TypeAlias = tuple[IntegratorState, list[m.Message]]
T = TypeVar("T")


def initial_state(setup: IntegratorSetup) -> IntegratorState:
    viewers = tuple(setup.cameras)
    tolerance = setup.frame_ns // 2
    views: dict[str, View] = {viewers[0]: "facade", viewers[1]: "flank"}
    return IntegratorState(
        Synchronizer(viewers, tolerance), Synchronizer(viewers, tolerance), Synchronizer(viewers, tolerance), views
    )


def step(setup: IntegratorSetup, state: IntegratorState, event: Event) -> Result:
    """Process one event: (state, messages).  Pure."""
    if isinstance(event, Tick):
        state, bodies = contradict_body(state)
        state, decisions = _decide_rate(setup, state, event)
        return state, [*bodies, *decisions]
    if not isinstance(event, Envelope):
        return state, []
    message = event.message
    match message:
        case m.Sighting(viewer=viewer):
            pairs, sightings = push(state.sightings, viewer, _time(state, message), message)
            return _for_each_frame_set(setup, replace(state, sightings=pairs), sightings, _assign)
        case m.PartialBdp(viewer=viewer):
            _validate(setup, message)
            bdps, pairs_of_bdps = push(state.bdps, viewer, _time(state, message), message)
            return _for_each_frame_set(setup, replace(state, bdps=bdps), pairs_of_bdps, define_body)
        case m.PartialBap(viewer=viewer):
            _validate(setup, message)
            baps, pairs_of_baps = push(state.baps, viewer, _time(state, message), message)
            state = note_answer(replace(state, baps=baps), viewer, _time(state, message))
            return _for_each_frame_set(setup, state, pairs_of_baps, pose_person)
        case m.Health(service="viewer", id=viewer) if viewer in setup.cameras:
            state = replace(state, rate=report(setup.rate, state.rate, message))
            return _set_clock(setup, state, viewer, offset_in(message)), []
        case m.FrameRate() if rate_control.awaits_recovery(state.rate):
            rate, messages = rate_control.resume(setup.rate, state.rate, message)
            return _follow(replace(state, rate=rate), messages)
        case m.FrameRate():
            rate, messages = rate_control.contradict(setup.rate, state.rate, message)
            return _follow(replace(state, rate=rate), messages)
        case m.UniversalBdp() | m.UniversalBap() if awaits_recovery(state):
            return resume(setup, state, message)
        case m.UniversalBdp():
            return note_body(state, message), []
        case m.Request(what="measure"):
            return measure_again(state), []
        case _:
            return state, []


def awaits_recovery(state: IntegratorState) -> bool:
    """True when a body and pose published before a restart would be recovered."""
    return state.person is None and not state.discard_recovered


def phase_of(state: IntegratorState) -> m.Phase:
    """Phase of the integrator, for its health."""
    if state.person is None:
        return m.Phase.MEASURING_BODY if state.bodies else m.Phase.AWAITING_PERSON
    return m.Phase.TRACKING


def describe(state: IntegratorState) -> str:
    """Health text of a state."""
    reduced = rate_control.describe(state.rate)
    return _describe_tracking(state) + (f"; {reduced}" if reduced else "")


def _describe_tracking(state: IntegratorState) -> str:
    if state.person is None:
        measured = f"measuring the body ({len(state.bodies)} of {INSTANTS_OF_BODY})" if state.bodies else ""
        return state.problem or measured or "waiting for the T-pose in both views"
    missing = [viewer for viewer in state.sightings.viewers if state.sightings.missed.get(viewer, 0) > 2]
    warnings = "".join(f"; {warning}" for warning in state.warnings.values())
    return "tracking" + (f", without viewer {' and '.join(missing)}" if missing else "") + warnings


def counts(state: IntegratorState) -> Mapping[str, int]:
    """Sightings and partial BAPs and BDPs that were late, duplicate, out of order, unknown or unpaired."""
    kinds = (("sighting", state.sightings.counts), ("bap", state.baps.counts), ("bdp", state.bdps.counts))
    return {f"{name}_{what}": count for name, kind in kinds for what, count in kind.items()}


def measure_again(state: IntegratorState) -> IntegratorState:
    """Drop person and body; on the next assignments the viewers measure the T-pose."""
    return replace(
        state, person=None, first=None, bodies=(), last={}, problem="", asked_ns=0, published_body=None, answered={},
        discard_recovered=True, contradicted=False,
    )  # fmt: skip


def _validate(setup: IntegratorSetup, message: m.PartialBdp | m.PartialBap) -> None:
    """Raise ValueError for joint angles of another anatomy, and for lengths other than those of this side."""
    if isinstance(message, m.PartialBap):
        angles_of(setup.anatomy, message.angles, setup.anatomy.neutral)
        return
    in_use = (FRONT_LENGTHS, SIDE_LENGTHS) if "body" in setup.additions else (PAPER_FRONT_LENGTHS, PAPER_SIDE_LENGTHS)
    expected = in_use[message.side == "side"]
    if message.lengths.keys() != set(expected) or min(message.lengths.values()) <= 0:
        found = ", ".join(f"{name} {length:g}" for name, length in sorted(message.lengths.items())) or "none"
        raise ValueError(f"lengths of the {message.side}, metres: {found}; expected above 0: {', '.join(expected)}")


def _set_clock(setup: IntegratorSetup, state: IntegratorState, viewer: str, offset: Offset | None) -> IntegratorState:
    """Store the clock offset of a viewer and its warning."""
    if offset is None:
        return state
    warning = clock_warning(f"viewer {viewer}", offset, setup.frame_ns)
    others = {other: text for other, text in state.warnings.items() if other != viewer}
    warnings = {**others, viewer: warning} if warning else others
    return replace(state, offsets={**state.offsets, viewer: offset}, warnings=warnings)


def _decide_rate(setup: IntegratorSetup, state: IntegratorState, tick: Tick) -> Result:
    """Decide on the frame rate by the reports of the viewers and the completeness of what they publish."""
    instants = state.sightings.complete + state.sightings.incomplete
    # A viewer that is late with the limbs publishes a sighting and no partial BAP.
    complete = min(instants, state.sightings.complete if state.person is None else state.baps.complete)
    rate = with_instants(state.rate, Instants(complete, instants - complete))
    rate, messages = rate_control.step(setup.rate, rate, tick)
    return _follow(replace(state, rate=rate), messages)


def _follow(state: IntegratorState, messages: list[m.Message]) -> Result:
    """Pair the viewers' messages at the rate that was decided."""
    for message in messages:
        if isinstance(message, m.FrameRate):
            spacing, from_ns = share_of(message).spacing, holds_from_ns(message)
            state = replace(
                state, sightings=with_spacing(state.sightings, spacing, from_ns),
                baps=with_spacing(state.baps, spacing, from_ns), bdps=with_spacing(state.bdps, spacing, from_ns),
            )  # fmt: skip
    return state, messages


def _time(state: IntegratorState, message: m.Sighting | m.PartialBdp | m.PartialBap) -> int:
    """Capture time on the clock of the integrator, ns."""
    offset = state.offsets.get(message.viewer)
    return to_integrator_ns(message.captured_ns, offset) if offset else message.captured_ns


def _for_each_frame_set(
    setup: IntegratorSetup,
    state: IntegratorState,
    frame_sets: Sequence[FrameSet[T]],
    process: Callable[[IntegratorSetup, IntegratorState, FrameSet[T]], Result],
) -> Result:
    messages: list[m.Message] = []
    for frames in frame_sets:
        state, more = process(setup, state, frames)
        messages += more
    return state, messages


def _assign(setup: IntegratorSetup, state: IntegratorState, frames: FrameSet[m.Sighting]) -> Result:
    state = replace(state, last={**state.last, **{v: s for v, s in frames.items.items() if s.present}})
    if state.person is None:
        return assign_first(setup, state, frames)
    state, republished = republish_body(state, frames)
    state, messages = assign_pose(setup, state, frames)
    return state, [*republished, *messages]
