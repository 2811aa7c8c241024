"""Reports of lost frames from viewers and tracker.  Pure."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from zenocap.common.messages import FrameRate, Health, Phase
from zenocap.common.runtime.clock_offset import offset_in, to_integrator_ns
from zenocap.common.runtime.frame_rate import KEPT_PERCENT, PHASE_US, SLOWEST_HZ, Share, ViewerCounts, counts_in, share_of
from zenocap.services.integrator.parameters import FEWEST_FRAMES, LOST, RATE_LEVELS
from zenocap.services.integrator.rate_ladder import Ladder

Limit = Literal["", "viewers", "tracker"]
TRACKER = "/tracker"  # among viewers, whose ids have no slash


@dataclass(frozen=True)
class RateSetup:
    """viewers: ids in the order of the rig.  fps: of the rig.  has_tracker: whether it has one."""

    viewers: tuple[str, ...]
    fps: float
    has_tracker: bool = False

    @property
    def shares(self) -> tuple[Share, ...]:
        """Shares of the frames that may be processed, from all to the fewest."""
        possible = (Share(*pair) for pair in RATE_LEVELS)
        return tuple(share for share in possible if share.value == 1 or share.value * self.fps >= SLOWEST_HZ)


@dataclass(frozen=True)
class Instants:
    """Numbers of frame sets so far: with all viewers, without some, and dropped by an overloaded tracker."""

    complete: int = 0
    incomplete: int = 0
    dropped: int = 0


@dataclass(frozen=True)
class RateState:
    """decided: last decision, of this integrator or of the one before a restart.  rate, detail: the levels in use.

    since, newest: counts by viewer at the last decision and now; since_instants, instants: the same of frame sets, None
    before the first report.  busy: share of its time that a viewer's or the tracker's loop works.
    phases: of the capture times by viewer, ns.
    settled_ns: time before which reports are about the rate before.  suspected: the last reports had losses.
    ticks: decisions so far.  now_ns: time of the last.
    repeats: ticks at which the decision is sent again, because another than this integrator's was received, or a viewer
    follows another: of two messages of the network it may receive one and this integrator the other.
    answered: whether it was sent again at once since the last tick.
    """

    decided: FrameRate | None = None
    rate: Ladder = field(default_factory=Ladder)
    detail: Ladder = field(default_factory=Ladder)
    since: Mapping[str, ViewerCounts] = field(default_factory=dict)
    newest: Mapping[str, ViewerCounts] = field(default_factory=dict)
    since_instants: Instants | None = None
    instants: Instants | None = None
    busy: Mapping[str, float] = field(default_factory=dict)
    phases: Mapping[str, int] = field(default_factory=dict)
    settled_ns: int = 0
    suspected: bool = False
    limit: Limit = ""
    limiting: tuple[str, ...] = ()
    ticks: int = 0
    now_ns: int = 0
    repeats: int = 0
    answered: bool = False

    @property
    def share(self) -> Share:
        return Share() if self.decided is None else share_of(self.decided)


@dataclass(frozen=True)
class LossShares:
    """Losses between two decisions, as shares.

    overrun: by viewer, of its processed frames before which others were lost, or which were answered too late.
    processed: by viewer, of its frames that were not dropped.  lost: of the frame sets, by viewers.  dropped: by the
    tracker.
    """

    overrun: Mapping[str, float]
    processed: Mapping[str, float]
    lost: float
    dropped: float

    @property
    def limiting(self) -> tuple[str, ...]:
        return tuple(viewer for viewer, share in self.overrun.items() if share > LOST)


def report(setup: RateSetup, state: RateState, health: Health) -> RateState:
    """State after a health of a viewer or of the tracker."""
    if health.service == "viewer" and health.id in setup.viewers and PHASE_US in health.counts:
        state = replace(state, phases={**state.phases, health.id: 1000 * health.counts[PHASE_US]})
    if to_integrator_ns(health.captured_ns, offset_in(health)) < state.settled_ns:
        return state
    if health.service == "tracker":
        if health.phase is not Phase.TRACKING:  # a search for the person takes longer than a frame period, and ends
            return replace(state, since_instants=None, instants=None)
        numbers = (health.counts.get(f"{name}_instants", 0) for name in ("whole", "incomplete", "dropped"))
        return with_instants(replace(state, busy={**state.busy, TRACKER: health.busy}), Instants(*numbers))
    if health.service != "viewer" or health.id not in setup.viewers:
        return state
    follows = state.decided is None or health.counts.get(KEPT_PERCENT, state.share.percent) == state.share.percent
    if not follows:
        state = replace(state, repeats=max(1, state.repeats))
    counts_now, before = counts_in(health), state.since.get(health.id)
    # What a viewer lost at another rate is no evidence about this one.
    restarted = not follows or before is None or counts_now.processed < before.processed
    return replace(
        state, since={**state.since, health.id: counts_now} if restarted else state.since,
        newest={**state.newest, health.id: counts_now}, busy={**state.busy, health.id: health.busy},
    )  # fmt: skip


def with_instants(state: RateState, instants: Instants) -> RateState:
    """State with the frame sets so far, of the tracker or of the integrator itself."""
    before = state.since_instants
    restarted = before is None or instants.complete + instants.incomplete < before.complete + before.incomplete
    return replace(state, since_instants=instants if restarted else before, instants=instants)


def losses(state: RateState) -> LossShares:
    """Losses since the last decision."""
    overrun, processed = {}, {}
    for viewer, now in state.newest.items():
        before = state.since[viewer]
        frames, dropped = now.processed - before.processed, max(0, now.dropped - before.dropped)
        if frames < FEWEST_FRAMES:  # silent, blocked or beginning: no evidence about the rate
            continue
        overrun[viewer] = min(1.0, max(0, now.overrun - before.overrun) / frames)
        processed[viewer] = frames / (frames + dropped)
    together = min(1.0, sum(overrun.values()))
    before_instants, instants = state.since_instants, state.instants
    if before_instants is None or instants is None:
        return LossShares(overrun, processed, together, 0.0)
    incomplete = instants.incomplete - before_instants.incomplete
    number = incomplete + instants.complete - before_instants.complete
    if number < FEWEST_FRAMES:
        return LossShares(overrun, processed, together, 0.0)
    # Instants that are incomplete for another reason, such as the network, are none of an overload.
    lost = min(together, incomplete / number)
    return LossShares(overrun, processed, lost, min(1.0, max(0, instants.dropped - before_instants.dropped) / number))
