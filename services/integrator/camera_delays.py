"""Delays of the cameras of a rig with a tracker, estimated from the silhouettes while it runs.  Pure.

The outlines of DELAY_WINDOW_NS are compared as `zenocap sync` compares those of a take, in parts: one follows every so many
silhouettes, and each tick.  Parts are a function of the events, so that a take is recomputed.
An estimate that the next one confirms is corrected when the rig has `delays = "follow"`: the tracker subtracts `applied_ms`
from the capture times.  Messages keep their times: every estimate is of the whole delay, and corrections do not feed back.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import copysign

from msgspec import structs

from zenocap.common.camera.pinhole import Camera
from zenocap.common.conversion import silhouette_mask
from zenocap.common.lags.delays import SKEW_US, CameraLags, lags_between, limits_of
from zenocap.common.lags.parts import PairsProgress
from zenocap.common.lags.tangents import Outline, outline_of
from zenocap.common.messages import CameraDelays, Message, Silhouette
from zenocap.common.runtime.clock_offset import Offset, to_integrator_ns
from zenocap.services.integrator import parameters as p

Delays = Mapping[str, float]  # ms, by viewer


@dataclass(frozen=True)
class DelaySetup:
    """cameras: by viewer, in the order of the rig.  frame_ns: frame period.  follow: whether delays are corrected."""

    cameras: Mapping[str, Camera]
    frame_ns: int
    follow: bool

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """The pairs of cameras that are compared, each with the next NEXT_CAMERAS, in the order of the rig."""
        names = list(self.cameras)
        near = {
            tuple(sorted((k, (k + step) % len(names))))
            for k in range(len(names))
            for step in range(1, p.NEXT_CAMERAS + 1)
            if (k + step) % len(names) != k
        }
        return tuple((names[a], names[b]) for a, b in sorted(near))

    @property
    def frame_ms(self) -> float:
        return self.frame_ns / 1e6


@dataclass(frozen=True)
class DelayState:
    """outlines: of the window, by viewer, since begin_ns of the capture times; None before the first.

    comparison: of the pairs, None while outlines are collected.
    resting_ns: time until which no outlines are collected.  offsets: clock of each viewer to this one.
    last: the last certain estimate, which the next one may confirm.  target: what is corrected, in the end.
    decided: the last message.  confirmed: whether two estimates agreed.  ticks: so far.  damaged: silhouettes.
    contradicted: the tracker has received a correction that is not of this integrator.
    """

    outlines: Mapping[str, tuple[Outline, ...]] = field(default_factory=dict)
    begin_ns: int | None = None
    comparison: PairsProgress | None = None
    resting_ns: int = 0
    now_ns: int = 0
    offsets: Mapping[str, Offset] = field(default_factory=dict)
    last: Delays = field(default_factory=dict)
    target: Delays = field(default_factory=dict)
    decided: CameraDelays | None = None
    confirmed: bool = False
    ticks: int = 0
    damaged: int = 0
    contradicted: bool = False


def awaits_recovery(state: DelayState) -> bool:
    """True while the decision of an integrator before a restart would be followed."""
    return state.decided is None and state.ticks < p.DELAY_RECOVERY_TICKS


def resume(setup: DelaySetup, state: DelayState, message: CameraDelays) -> tuple[DelayState, list[Message]]:
    """Continue with the decision before a restart, of viewers that the rig has, and publish it again.

    It is published as it was, or without its corrections where they are not followed any more.  One with a correction that
    none can have found is ignored.
    """
    most_ms = 1e3 * p.MOST_DELAY_S * (len(setup.cameras) - 1)  # of cameras in a row
    known = message.found_ms.keys() | message.errors_ms.keys() | message.applied_ms.keys() <= setup.cameras.keys()
    if not known or max(message.applied_ms.values(), default=0.0) > most_ms:
        return state, []
    applied = dict(message.applied_ms) if setup.follow else {}
    if applied != message.applied_ms:
        message = replace_applied(message, message.captured_ns + 1, applied)  # a time of its own: takes are verified by it
    return replace(state, decided=message, target=applied), [message]


def note_other(setup: DelaySetup, state: DelayState, message: CameraDelays) -> DelayState:
    """Note a correction that is not this integrator's: the tracker follows the last one until there is another."""
    own = {} if state.decided is None else state.decided.applied_ms
    return state if not setup.follow or message.applied_ms == own else replace(state, contradicted=True)


def replace_applied(message: CameraDelays, now_ns: int, applied: Delays) -> CameraDelays:
    """The next message with this correction."""
    return structs.replace(message, frame=message.frame + 1, captured_ns=now_ns, applied_ms=dict(applied))


def collect(setup: DelaySetup, state: DelayState, silhouette: Silhouette) -> DelayState:
    """The state with the outline of one silhouette, while outlines are collected; or with the next part of a comparison."""
    camera = setup.cameras.get(silhouette.viewer)
    if camera is None or state.now_ns < state.resting_ns:
        return state
    if state.comparison is not None:
        return replace(state, comparison=state.comparison.after_silhouette())
    captured_ns = to_integrator_ns(silhouette.captured_ns, state.offsets.get(silhouette.viewer))
    try:
        mask = silhouette_mask(silhouette, camera.size)
    except ValueError:
        return replace(state, damaged=state.damaged + 1)
    if abs(captured_ns - state.now_ns) > p.DELAY_WINDOW_NS:
        return state  # a clock whose offset is not known yet: a window that begins in the future would never end
    begin_ns = captured_ns if state.begin_ns is None else state.begin_ns
    outline = outline_of(camera, mask, (captured_ns - begin_ns) / 1e9)
    before = state.outlines.get(silhouette.viewer, ())
    if outline is None or (before and outline.time_s <= before[-1].time_s):
        return state
    outlines = {**state.outlines, silhouette.viewer: (*before, outline)}
    comparison = None
    if outline.time_s > p.DELAY_WINDOW_NS / 1e9:
        comparison = PairsProgress(setup.cameras, setup.pairs, outlines, limits_of(p.MOST_DELAY_S), p.FEWEST_OUTLINES)
    return replace(state, outlines=outlines, begin_ns=begin_ns, comparison=comparison)


def decide(setup: DelaySetup, state: DelayState, now_ns: int) -> tuple[DelayState, list[Message]]:
    """One tick: a part of the comparison, or the estimate after the last one; and one step of the correction."""
    state = replace(state, ticks=state.ticks + 1, now_ns=now_ns)
    before = state.decided
    if state.comparison is not None and state.comparison.ended:
        state = _estimate(setup, state, state.comparison, now_ns)
    elif state.comparison is not None:
        state = replace(state, comparison=state.comparison.next_part())
    decided = state.decided
    if decided is not None and setup.follow and state.target:
        applied = _toward(decided.applied_ms, state.target, p.DELAY_STEP * setup.frame_ms)
        if applied != decided.applied_ms:
            frame = decided.frame if before is None else before.frame + 1
            decided = structs.replace(decided, frame=frame, captured_ns=now_ns, applied_ms=applied)
    if state.contradicted and decided is before:
        empty = CameraDelays(frame=-1, captured_ns=now_ns, found_ms={}, errors_ms={}, uncertain=[], applied_ms={})
        decided = replace_applied(decided or empty, now_ns, {} if decided is None else decided.applied_ms)
    # At most one message: a take is verified by key and capture time.
    messages: list[Message] = [decided] if decided is not None and decided is not before else []
    return replace(state, decided=decided, contradicted=False), messages


def _estimate(setup: DelaySetup, state: DelayState, comparison: PairsProgress, now_ns: int) -> DelayState:
    """The state after the estimate from all pairs; outlines are collected again at once, or after a rest."""
    lags = lags_between(comparison.names, comparison.compared, comparison.limits)
    lags = lags if len(lags.certain) > 1 else CameraLags({})
    certain, found = lags.certain, lags.delays_ms
    before, last, target = state.decided, state.last, state.target
    errors = {viewer: 1e3 * one.error_s for viewer, one in certain.items()}
    confirmed = state.confirmed
    # The reference may be a camera that is missing from a partial estimate, which is therefore only reported.
    if len(certain) == len(setup.cameras):
        confirmed = bool(last) and _agree(setup, found, last, errors)
        if confirmed and setup.follow:
            mean = {viewer: (found[viewer] + last[viewer]) / 2 for viewer in found}
            if any(abs(mean[viewer] - target.get(viewer, 0.0)) > p.DELAYS_AGREE * setup.frame_ms for viewer in mean):
                target = mean
        last = found
    decided = CameraDelays(
        frame=0 if before is None else before.frame + 1, captured_ns=now_ns, found_ms=found, errors_ms=errors,
        uncertain=[viewer for viewer in setup.cameras if viewer not in certain],
        applied_ms={} if before is None else before.applied_ms,
    )  # fmt: skip
    resting_ns = now_ns + (p.DELAY_REST_NS if confirmed else 0)
    return DelayState(
        resting_ns=resting_ns, now_ns=now_ns, offsets=state.offsets, last=last, target=target, decided=decided,
        confirmed=confirmed, ticks=state.ticks, damaged=state.damaged,
    )  # fmt: skip


def _agree(setup: DelaySetup, found: Delays, last: Delays, errors: Delays) -> bool:
    """Whether two estimates have the same delays, within a share of a frame period or their errors."""
    return all(
        abs(found[viewer] - last[viewer]) <= max(p.DELAYS_AGREE * setup.frame_ms, p.DELAY_ERRORS * errors[viewer])
        for viewer in found
    )


def _toward(applied: Delays, target: Delays, step_ms: float) -> dict[str, float]:
    """The correction one step nearer to its target."""
    steps = {viewer: value - applied.get(viewer, 0.0) for viewer, value in target.items()}
    return {
        viewer: target[viewer] if abs(step) <= step_ms else applied.get(viewer, 0.0) + copysign(step_ms, step)
        for viewer, step in steps.items()
    }


def skew_ms(message: CameraDelays) -> float:
    """Largest delay between two cameras that is not corrected, ms."""
    left = [value - message.applied_ms.get(viewer, 0.0) for viewer, value in message.found_ms.items()]
    return max(left) - min(left) if left else 0.0


def describe(setup: DelaySetup, state: DelayState) -> str:
    """Health text: the cameras that are late by a quarter of a frame period or more; empty without any."""
    message = state.decided
    if message is None:
        return ""
    late = {viewer: ms for viewer, ms in message.found_ms.items() if ms > p.DELAYS_AGREE * setup.frame_ms}
    parts = []
    for viewer, ms in late.items():
        applied = message.applied_ms.get(viewer, 0.0)
        corrected = f", corrected by {applied:.0f}" if message.applied_ms else ""
        parts.append(f"viewer {viewer} {ms:.0f} ms ({ms / setup.frame_ms:.1f} frames) late{corrected}")
    return f"images older than their times: {', '.join(parts)}" if parts else ""


def counts(state: DelayState) -> Mapping[str, int]:
    """Counts for the health, once there is an estimate."""
    counts = {"silhouette_damaged": state.damaged} if state.damaged else {}
    if state.decided is not None and state.decided.found_ms:
        counts[SKEW_US] = round(1e3 * skew_ms(state.decided))
    return counts
