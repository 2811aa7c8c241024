"""Inconsistent views: wrong calibration, frozen, empty or out of step.

The viewing line of a contour point touches the person, so some point of it is in the silhouettes of all views.  A line
without such a point has no support.  Two averages over time identify the view at fault:
- the unsupported fraction of the other contours without view j, neither its lines nor its silhouette: small for the one
  at fault;
- the unsupported fraction of all contours with view j shifted by some frames: as small as without the view when the shift
  equals its lag; only somewhat smaller when its calibration is wrong.

`common.lags` estimates delays in seconds from the outlines of many seconds, and takes the calibration for right.  Here a
view is judged within a second or two, to whole frames, by what the tracker fits: its result is which view to leave out.
"""

# Paper (added): [Hybrid] trusts every view.

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.services.tracker import parameters as p
from zenocap.services.tracker.hull.contours import Contours
from zenocap.services.tracker.hull.views import Silhouettes
from zenocap.services.tracker.view_check.line_support import (
    SUPPORTED,
    Outlines,
    in_view,
    lagged_unsupported,
    line_support,
    sample_lines,
)
from zenocap.services.tracker.view_check.repeated_pictures import ViewRun, continued


@dataclass(frozen=True)
class Finding:
    """Fault of a view.  view: its index; -1 when no single view explains it."""

    kind: Literal["calibration", "out-of-step", "frozen", "empty", "disagreement"]
    view: int
    text: str


@dataclass(frozen=True, eq=False)
class ViewConsistency:
    """Statistics of v views over the recent frames, updated by `check_views`.

    frames: number so far.  recent: contours and silhouettes of the last MAX_LAG_FRAMES + 1 frames, the newest last.
    checks: number of checks.  own: (v,) unsupported fraction of each view's contour.  without: (v,) that of the other
    contours when the view is left out.
    lagged: (v, 2 * MAX_LAG_FRAMES + 1) unsupported fraction of all contours for each lag of the view.
    tested: (v,) tests of lags.  empty: (v,) checks in a row without a silhouette.  runs: equal pictures of each view.
    """

    names: tuple[str, ...]
    frames: int
    recent: tuple[Outlines, ...]
    checks: int
    own: Floats
    without: Floats
    lagged: Floats
    tested: Ints
    runs: tuple[ViewRun, ...]
    empty: Ints
    findings: tuple[Finding, ...]


def initial_consistency(names: Sequence[str]) -> ViewConsistency:
    """Statistics of views of these names before the first frame."""
    n = len(names)
    counts = np.zeros(n, dtype=np.int64)
    shares = np.full(n, np.nan)
    lagged = np.full((n, 2 * p.MAX_LAG_FRAMES + 1), np.nan)
    return ViewConsistency(tuple(names), 0, (), 0, shares, shares, lagged, counts, (), counts, ())


def check_views(
    state: ViewConsistency, captured_ns: int, contours: Contours, silhouettes: Silhouettes
) -> tuple[ViewConsistency, tuple[Finding, ...]]:
    """Update the statistics by one frame, `outlines` of all views; returns them with the present findings.

    Repeated pictures are found in every frame, the rest in every CHECK_PERIOD_FRAMES-th one, without a frozen view.
    """
    recent = (*state.recent[-p.MAX_LAG_FRAMES :], (contours, silhouettes))
    runs = continued(state.runs, captured_ns, silhouettes)
    state = replace(state, frames=state.frames + 1, recent=recent, runs=runs)
    frozen = {j for j, run in enumerate(runs) if run.is_frozen(captured_ns)}
    if len(recent) > p.MAX_LAG_FRAMES and state.frames % p.CHECK_PERIOD_FRAMES in (0, p.CHECK_PERIOD_FRAMES // 2):
        if state.frames % p.CHECK_PERIOD_FRAMES == 0:
            state = _update_empty(replace(state, checks=state.checks + 1))
            state = state if frozen else _update_support(state)
        elif state.checks > 0 and not frozen:
            state = _test_lags(state)  # on another frame, to spread the cost
        state = replace(state, findings=_findings(state))
    text = "view {} is frozen: it repeats a picture while the others change"
    found = [Finding("frozen", j, text.format(state.names[j])) for j in sorted(frozen)]
    return state, (*found, *(one for one in state.findings if one.view not in frozen))


def untested_lags(state: ViewConsistency) -> ViewConsistency:
    """Statistics after which lags are tested again, from frames that follow."""
    lagged, tested = np.full_like(state.lagged, np.nan), np.zeros_like(state.tested)
    return replace(state, recent=(), lagged=lagged, tested=tested)


def untrusted(findings: Sequence[Finding]) -> frozenset[int]:
    """Views to leave out of tracking."""
    return frozenset(f.view for f in findings if f.kind in ("calibration", "out-of-step", "frozen"))


def _update_empty(state: ViewConsistency) -> ViewConsistency:
    """Count checks without a silhouette where the person is in view."""
    silhouettes = state.recent[-1][1]
    return replace(state, empty=np.where((silhouettes.box[:, 2] == 0) & in_view(silhouettes), state.empty + 1, 0))


def _update_support(state: ViewConsistency) -> ViewConsistency:
    """Update the averages of support by the newest frame."""
    silhouettes = state.recent[-1][1]
    lines = sample_lines(state.recent[-1], p.LINES_PER_VIEW, state.checks)
    present = np.flatnonzero(np.bincount(lines.view, minlength=len(state.names)))
    if len(present) < 2:
        return state
    found = line_support(lines.view, lines.directions, silhouettes)
    own, without = state.own.copy(), state.without.copy()
    unsupported = found != SUPPORTED
    for j in present.tolist():
        own_lines = lines.view == j
        supported_without = (found[~own_lines] >> j) & 1 == 1
        own[j] = _running_mean(own[j], float(np.mean(unsupported[own_lines])), state.checks)
        without[j] = _running_mean(without[j], float(np.mean(unsupported[~own_lines] & ~supported_without)), state.checks)
    return replace(state, own=own, without=without)


def _test_lags(state: ViewConsistency) -> ViewConsistency:
    """Update the averages of support at every lag of one suspect, in turn, while contours lack support."""
    suspects = _suspects(state)
    if len(_present(state)) < 3 or len(suspects) > p.MAX_SUSPECTS or np.nanmax(state.own) < p.LAG_TEST_UNSUPPORTED:
        return state
    if np.nanmax(state.without) - np.nanmin(state.without) < p.LAG_TEST_DIFFERENCE:
        return state
    j = suspects[state.checks % len(suspects)]
    if state.tested[j] >= p.CHECK_MEMORY and state.checks % p.LAG_TEST_PERIOD >= len(suspects):
        return state
    shares = lagged_unsupported(state.recent, j, p.LAG_TEST_LINES // len(state.names), state.checks)
    if not np.isfinite(shares).all():
        return state
    lagged, tested = state.lagged.copy(), state.tested.copy()
    tested[j] += 1
    lagged[j] = [_running_mean(a, b, int(tested[j])) for a, b in zip(lagged[j], shares, strict=True)]
    return replace(state, lagged=lagged, tested=tested)


def _present(state: ViewConsistency) -> list[int]:
    """Views with a silhouette, in ascending order of the unsupported fraction without them."""
    present = np.flatnonzero(np.isfinite(state.own) & (state.recent[-1][1].box[:, 2] > 0))
    return sorted(present.tolist(), key=lambda j: float(state.without[j]))


def _suspects(state: ViewConsistency) -> list[int]:
    """Views whose removal makes the others about as consistent as the removal of the best one does."""
    present = _present(state)
    return [j for j in present if state.without[j] < p.SUSPECT_RATIO * state.without[present[0]] + p.SUSPECT_MARGIN]


def _findings(state: ViewConsistency) -> tuple[Finding, ...]:
    """Findings from the present statistics, but for frozen views."""
    findings = []
    for j, name in enumerate(state.names):
        if state.empty[j] >= p.PERSISTENT_CHECKS:
            text = f"view {name} is empty for {state.empty[j] * p.CHECK_PERIOD_FRAMES} frames; other views see a person"
            findings.append(Finding("empty", j, text))
    if state.checks < p.MIN_CHECKS or len(_present(state)) < 2:
        return tuple(findings)
    return (*findings, *(_out_of_step(state) or _miscalibrated(state)))


def _out_of_step(state: ViewConsistency) -> list[Finding]:
    """Finding for a view whose shift by its lag makes the contours as consistent as without it."""
    suspects = _suspects(state)
    if len(suspects) > p.MAX_SUSPECTS or any(state.tested[j] < p.MIN_LAG_TESTS for j in suspects):
        return []
    j = min(suspects, key=lambda k: float(np.min(state.lagged[k])))
    shares, rest = state.lagged[j], float(state.without[suspects[0]])
    lag, now, best = int(np.argmin(shares)) - p.MAX_LAG_FRAMES, float(shares[p.MAX_LAG_FRAMES]), float(np.min(shares))
    reported = any(f.kind == "out-of-step" and f.view == j for f in state.findings)
    enough = max(p.LAG_GAIN, p.LAG_EXPLAINED * (now - rest)) * (p.LAG_HYSTERESIS if reported else 1.0)
    if lag == 0 or now - best < enough:
        return []
    frames = f"{abs(lag)} frame{'s' if abs(lag) > 1 else ''} {'late' if lag > 0 else 'early'}"
    text = (
        f"view {state.names[j]} is out of step, {frames}: {_percent(now)} of all contours lack support, "
        f"{_percent(best)} with the lag corrected"
    )
    return [Finding("out-of-step", j, text)]


def _miscalibrated(state: ViewConsistency) -> list[Finding]:
    """Finding for the one view without which the others are consistent; for no single view when they disagree much."""
    present = _present(state)
    j = present[0]
    own, rest = float(state.own[j]), float(state.without[j])
    clear = len(present) >= 3 and len(_suspects(state)) == 1
    if clear and own >= max(p.CALIBRATION_UNSUPPORTED, p.CALIBRATION_RATIO * rest):
        if state.tested[j] < p.MIN_LAG_TESTS:
            return []  # the view may be out of step instead
        text = (
            f"view {state.names[j]} disagrees with the others: {_percent(own)} of its contour lacks support"
            f" (others {_percent(rest)}): its calibration or position is wrong"
        )
        return [Finding("calibration", j, text)]
    overall = float(np.mean(state.own[present]))
    if overall >= p.DISAGREEMENT_UNSUPPORTED:
        text = f"the views disagree: {_percent(overall)} of their contours lack support; no single view explains it"
        return [Finding("disagreement", -1, text)]
    return []


def _running_mean(average: float, value: float, count: int) -> float:
    """Mean of the first `count` values, then an exponential one over CHECK_MEMORY."""
    return value if not np.isfinite(average) else average + (value - average) / min(count, p.CHECK_MEMORY)


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"
