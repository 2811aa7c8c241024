"""Frame rate of an overloaded rig and detail of its tracker.  Pure.

Viewers and tracker report in their health what they lost.  Every DECISION_NS the integrator compares the reports since the
last decision.  While too many frame sets are lost it lowers the rate, or first the number of the tracker's points and
particles; after some time without losses it raises them.  A level that has failed is tried again after a wait, which is
doubled each time it fails.
"""

from dataclasses import replace

from msgspec import structs

from zenocap.common.bus.protocol import Alive, Envelope, FrameLike, Tick
from zenocap.common.messages import FrameRate, Health, Message, TrackerDetail
from zenocap.common.runtime.frame_rate import (
    ViewerCounts,
    common_phase,
    farthest_phase,
    reduced_text,
    share_of,
    time_after,
)
from zenocap.services.integrator import parameters
from zenocap.services.integrator.rate_ladder import Ladder, lowered, raised
from zenocap.services.integrator.rate_reports import TRACKER, Limit, LossShares, RateSetup, RateState, losses, report


def step(setup: RateSetup, state: RateState, event: FrameLike | Envelope | Alive | Tick) -> tuple[RateState, list[Message]]:
    """Process one event: a report, a decision before a restart, or the time of the next decision.  Pure."""
    match event:
        case Envelope(message=Health() as health):
            return report(setup, state, health), []
        case Envelope(message=FrameRate() as message) if awaits_recovery(state):
            return resume(setup, state, message)
        case Envelope(message=FrameRate() | TrackerDetail() as message):
            return contradict(setup, state, message)
        case Tick(received_ns=now_ns):
            return decide(setup, state, now_ns)
        case _:
            return state, []


def awaits_recovery(state: RateState) -> bool:
    """True while a decision that was published before a restart would be followed."""
    return state.decided is None


def resume(setup: RateSetup, state: RateState, message: FrameRate) -> tuple[RateState, list[Message]]:
    """Continue with the decision before a restart, and publish it again; one of another rig is ignored."""
    if share_of(message) not in setup.shares:
        return state, []
    now_ns = min(message.captured_ns, state.now_ns or message.captured_ns)  # since a time ahead nothing would ever be calm
    rate = Ladder(setup.shares.index(share_of(message)), calm_ns=now_ns)
    state = replace(state, decided=message, rate=rate, detail=Ladder(calm_ns=now_ns), limit=message.limit, now_ns=now_ns)
    return replace(state, limiting=tuple(message.viewers)), [message, *_detail(setup, state, now_ns)]


def contradict(setup: RateSetup, state: RateState, message: FrameRate | TrackerDetail) -> tuple[RateState, list[Message]]:
    """Contradict a decision that is not this integrator's: viewers and tracker follow the last one until there is another.

    As of a second integrator, in the other part of a network that was cut.  Its own is sent again at once, but once between
    two ticks, and at REPEATS ticks: a viewer may receive both in the other order.
    """
    decided = state.decided
    if decided is None:
        return state, []
    match message:
        case FrameRate():
            # One of a later time is not own: viewers would ignore the next decision until then.
            own = _content(decided) == _content(message) and message.captured_ns <= decided.captured_ns
            repeats = parameters.REPEATS
        case TrackerDetail(share=share):
            own = not setup.has_tracker or share == parameters.DETAIL_LEVELS[state.detail.level]
            repeats = 1  # it is followed whatever its time is
    if own:
        return state, []
    state = replace(state, repeats=max(repeats, state.repeats))
    if state.answered:
        return state, []
    own_ns = time_after(decided.captured_ns, state.now_ns + 1)  # a time of its own: takes are verified by it
    if isinstance(message, FrameRate):
        own_ns = time_after(message.captured_ns, own_ns)
    again = _again(decided, own_ns, state.now_ns)
    return replace(state, decided=again, answered=True), [again, *_detail(setup, state, own_ns)]


def _content(message: FrameRate) -> tuple[int, int, int, float, str, list[str]]:
    """What viewers and tracker follow, and what is shown."""
    return message.keep, message.of, message.phase_ns, message.fps, message.limit, message.viewers


def _again(decided: FrameRate, own_ns: int, from_ns: int) -> FrameRate:
    """The decision in force once more, at another time."""
    return structs.replace(decided, frame=decided.frame + 1, captured_ns=own_ns, from_ns=from_ns)


def decide(setup: RateSetup, state: RateState, now_ns: int) -> tuple[RateState, list[Message]]:
    """Levels of the next interval, and a message when they change, or when another decision was received."""
    state = replace(state, ticks=state.ticks + 1, now_ns=now_ns, answered=False)
    if (decided := state.decided) is None:
        if state.ticks < parameters.RECOVERY_TICKS:
            return state, []
        state = replace(state, rate=Ladder(calm_ns=now_ns), detail=Ladder(calm_ns=now_ns))
        state, first = _new_rate(setup, state, now_ns)
        return state, [first, *_detail(setup, state, now_ns)]
    repeats = state.repeats
    state, rates, details = _adapted(setup, state, now_ns)
    if not repeats:
        return state, [*details, *rates]
    state = replace(state, repeats=repeats - 1)
    if not rates:  # it has not changed: reports remain of use
        again = _again(decided, time_after(decided.captured_ns, now_ns), now_ns)
        state, rates = replace(state, decided=again), [again]
    return state, [*rates, *(details or _detail(setup, state, now_ns))]


def _adapted(setup: RateSetup, state: RateState, now_ns: int) -> tuple[RateState, list[Message], list[Message]]:
    """The levels by the reports since the last change; the message of a new rate, and of a new detail, if any."""
    if now_ns < state.settled_ns or not state.newest:
        return state, [], []
    found = losses(state)
    if not found.overrun:
        return state, [], []
    after = _adjusted(setup, state, found, now_ns)
    after = replace(after, since=after.newest, since_instants=after.instants)
    rates: list[Message] = []
    details: list[Message] = []
    if after.detail.level != state.detail.level:
        details = _detail(setup, after, now_ns)
        after = _settling(after, now_ns)
    if after.rate.level != state.rate.level or _out_of_phase(setup, after):
        after, rate = _new_rate(setup, after, now_ns)
        rates = [rate]
    return after, rates, details


def _adjusted(setup: RateSetup, state: RateState, found: LossShares, now_ns: int) -> RateState:
    worst = max(found.overrun.values(), default=0.0)
    suspected = max(worst, found.lost, found.dropped) > parameters.LOST
    # One stall loses many frame sets in one interval: only the share of overrun frames counts at once.
    too_fast = worst > parameters.LOST_AT_ONCE or (found.lost > parameters.LOST and state.suspected)
    too_detailed = found.dropped > parameters.LOST_AT_ONCE or (found.dropped > parameters.LOST and state.suspected)
    state = replace(state, suspected=suspected)
    if suspected:
        rate, detail = replace(state.rate, calm_ns=now_ns), replace(state.detail, calm_ns=now_ns)
        state = replace(state, rate=rate, detail=detail)
    shares = setup.shares
    thinned = too_detailed and state.detail.level + 1 < len(parameters.DETAIL_LEVELS)
    if thinned:
        state = replace(state, detail=lowered(state.detail, state.detail.level + 1, now_ns))
    if too_fast or (too_detailed and not thinned):
        # While frames are dropped, what is processed is about what can be.
        possible = [found.processed[viewer] for viewer in found.limiting] if too_fast else [1.0 - found.dropped]
        most = shares[state.rate.level].value * max(parameters.GREATEST_CUT, min(possible, default=1.0))
        below = range(state.rate.level + 1, len(shares))
        level = next((level for level in below if shares[level].value <= most + 1e-9), len(shares) - 1)
        limit: Limit = "viewers" if too_fast else "tracker"
        state = replace(state, limit=limit, limiting=found.limiting if too_fast else ())
        if level > state.rate.level:
            state = replace(state, rate=lowered(state.rate, level, now_ns))
    elif not suspected and state.rate.level > 0:
        busiest = max(state.busy.values(), default=0.0)
        state = replace(state, rate=raised(state.rate, [share.value for share in shares], busiest, now_ns))
    elif not suspected and state.detail.level > 0:
        state = replace(state, detail=raised(state.detail, parameters.DETAIL_LEVELS, state.busy.get(TRACKER, 0.0), now_ns))
    return state if state.rate.level else replace(state, limit="", limiting=())


def _out_of_phase(setup: RateSetup, state: RateState) -> bool:
    """Whether jitter decides which frames are chosen, because the cameras have drifted, and other slots are better."""
    if state.decided is None or state.rate.level == 0:
        return False
    phases = state.phases.values()
    best = farthest_phase(phases, common_phase(phases, setup.fps), setup.fps)
    now = farthest_phase(phases, state.decided.phase_ns, setup.fps)
    return now > parameters.FARTHEST_PHASE and now - best > parameters.PHASE_GAIN


def _new_rate(setup: RateSetup, state: RateState, now_ns: int) -> tuple[RateState, FrameRate]:
    """State after the rate has changed, and the message for viewers and tracker."""
    share, last = setup.shares[state.rate.level], state.decided
    message = FrameRate(
        frame=0 if last is None else last.frame + 1,
        captured_ns=now_ns if last is None else time_after(last.captured_ns, now_ns), keep=share.keep, of=share.of,
        from_ns=now_ns + parameters.LEAD_NS, phase_ns=common_phase(state.phases.values(), setup.fps), fps=setup.fps,
        limit=state.limit if state.rate.level else "",
        viewers=list(state.limiting[:parameters.MOST_NAMED]) if state.rate.level else [],
    )  # fmt: skip
    return _settling(replace(state, decided=message), now_ns), message


def _detail(setup: RateSetup, state: RateState, now_ns: int) -> list[Message]:
    """The message for the tracker, if there is one."""
    share = parameters.DETAIL_LEVELS[state.detail.level]
    return [TrackerDetail(frame=state.ticks, captured_ns=now_ns, share=share)] if setup.has_tracker else []


def _settling(state: RateState, now_ns: int) -> RateState:
    """State after a change: reports about the levels before are not used."""
    none: dict[str, ViewerCounts] = {}
    state = replace(state, since=none, newest=none, since_instants=None, instants=None, suspected=False)
    return replace(state, settled_ns=now_ns + parameters.LEAD_NS + parameters.SETTLE_NS)


def describe(state: RateState) -> str:
    """Health text; empty at full rate and detail."""
    return reduced_text(state.decided, parameters.DETAIL_LEVELS[state.detail.level])
