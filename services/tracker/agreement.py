"""Which view disagrees with the others, from their silhouettes alone: a wrong calibration, a frozen or empty view, or one
that is out of step.

A contour's viewing line touches the person, so in every other view some of it lies in the silhouette, in all views the
same place.  A line without such a place has no support.  Averages over time say whose fault that is:
- without view j as a witness and as a judge, how much of the others' outlines has no support: small for the one at fault;
- how much of all outlines has no support when view j is taken some frames later or earlier than the others: as good as
  without it when that makes up for its lag; only less bad when its calibration is wrong.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from services.tracker.agreement_lines import LAGS, Moment, in_sight, lagged_shares, lines_of
from services.tracker.hull_contours import Contours
from services.tracker.hull_support import SUPPORTED, changed, support
from services.tracker.hull_views import Floats, Integers, Silhouettes

EVERY = 5  # frames between two checks
LINES = 16  # of each view in a check
LAG_LINES = 32  # of all views in a test of lags
MEMORY = 24  # checks or tests that an average remembers
LEAST = 12  # checks before an average is believed
LEAST_TESTS = 12  # of a view's lags
SELDOM = 12  # checks between two tests of lags once they are known
STEADY = 6  # checks in a row for which a view is empty or frozen before that is said
SUSPECTS = 2  # at most, whose lags are tested in turns: where more are, it is not one view's fault

UNSUPPORTED = 0.10  # share of a view's outline without support from which it may be at fault
WORSE = 3.0  # times the others' without it
APART, MARGIN = 1.5, 0.01  # how much worse, at the least, the others must be when another view is left out
SUSPICIOUS = 0.05  # share of a view's outline from which,
UNEVEN = 0.02  # and difference between views left out from which, lags are tested
LAG_GAIN = 0.03  # share of all outlines that must gain support at the lag
EXPLAINED = 0.8  # of what lacks support because of the view
STAYS = 0.6  # of these is enough for what was said before
NOBODY_FITS = 0.40  # share of all outlines without support from which to speak up when no view can be blamed
STILL, MOVING = 0.001, 0.01  # share of a silhouette that changes between checks: frozen, moving


@dataclass(frozen=True)
class Finding:
    """What is wrong with a view.

    view: its index; -1 when no view can be blamed.  figure: share of the outline without support (calibration,
    disagreement), frames by which the view is late, negative when early (out-of-step), or frames that it has lasted.
    """

    kind: Literal["calibration", "out-of-step", "frozen", "empty", "disagreement"]
    view: int
    figure: float
    text: str


@dataclass(frozen=True, eq=False)
class Agreement:
    """What is remembered of v views; begin with `agreement(names)`.

    frames: seen so far.  recent: contours and silhouettes of the last frames, the newest last.  checked: the silhouettes
    of the last check.  checks: how many there were.  own: (v,) share of each outline without support.  without: (v,) share
    of the others' outlines without support when the view is left out.  lagged: (v, 2 * LAGS + 1) share of all outlines
    without support when the view is late by -LAGS ... LAGS frames.  tested: (v,) tests of lags.  still, empty: (v,) checks
    in a row.
    """

    names: tuple[str, ...]
    frames: int
    recent: tuple[Moment, ...]
    checked: Silhouettes | None
    checks: int
    own: Floats
    without: Floats
    lagged: Floats
    tested: Integers
    still: Integers
    empty: Integers
    findings: tuple[Finding, ...]


def agreement(names: Sequence[str]) -> Agreement:
    """Nothing seen yet of views of these names."""
    n = len(names)
    counts = np.zeros(n, dtype=np.int64)
    shares = np.full(n, np.nan)
    lagged = np.full((n, 2 * LAGS + 1), np.nan)
    return Agreement(tuple(names), 0, (), None, 0, shares, shares, lagged, counts, counts, counts, ())


def watch(state: Agreement, contours: Contours, seen: Silhouettes) -> tuple[Agreement, tuple[Finding, ...]]:
    """One frame of all views, as `hull.outlines` gives it; what is wrong by now.  Works on every EVERY-th frame."""
    recent = (*state.recent[-LAGS:], (contours, seen))
    state = replace(state, frames=state.frames + 1, recent=recent)
    if len(recent) <= LAGS or state.frames % EVERY not in (0, EVERY // 2):
        return state, state.findings
    if state.frames % EVERY == 0:
        state = _support(_compare(replace(state, checks=state.checks + 1)))
        state = replace(state, checked=seen)
    elif state.checks > 0:
        state = _test_lags(state)  # on another frame, so that no frame waits for both
    state = replace(state, findings=_judge(state))
    return state, state.findings


def untrusted(findings: Sequence[Finding]) -> frozenset[int]:
    """The views to track without."""
    return frozenset(f.view for f in findings if f.kind in ("calibration", "out-of-step", "frozen"))


def _compare(state: Agreement) -> Agreement:
    """Counts checks without anybody, and without change while the others change."""
    seen = state.recent[-1][1]
    empty = np.where((seen.box[:, 2] == 0) & in_sight(seen), state.empty + 1, 0)
    if state.checked is None:
        return replace(state, empty=empty)
    change = changed(state.checked, seen)
    present = np.isfinite(change)
    moving = bool(present.any()) and float(np.median(change[present])) >= MOVING
    # While everybody stands still nothing can be said, so a count stands still too.
    still = np.where(present & (change <= STILL), state.still + (1 if moving else 0), 0)
    return replace(state, empty=empty, still=still)


def _support(state: Agreement) -> Agreement:
    """Averages of the support in the newest frame."""
    seen = state.recent[-1][1]
    lines = lines_of(state.recent[-1], LINES, state.checks)
    present = np.flatnonzero(np.bincount(lines.view, minlength=len(state.names)))
    if len(present) < 2:
        return state
    found = support(lines.view, lines.directions, seen)
    own, without = state.own.copy(), state.without.copy()
    lacking = found != SUPPORTED
    for j in present.tolist():
        mine = lines.view == j
        rescued = (found[~mine] >> j) & 1 == 1
        own[j] = _averaged(own[j], float(np.mean(lacking[mine])), state.checks)
        without[j] = _averaged(without[j], float(np.mean(lacking[~mine] & ~rescued)), state.checks)
    return replace(state, own=own, without=without)


def _test_lags(state: Agreement) -> Agreement:
    """Averages of the support at every lag of one suspect, in turns, while outlines lack support."""
    suspects = _suspects(state)
    if len(_present(state)) < 3 or len(suspects) > SUSPECTS or np.nanmax(state.own) < SUSPICIOUS:
        return state
    if np.nanmax(state.without) - np.nanmin(state.without) < UNEVEN:
        return state
    j = suspects[state.checks % len(suspects)]
    if state.tested[j] >= MEMORY and state.checks % SELDOM >= len(suspects):
        return state
    shares = lagged_shares(state.recent, j, LAG_LINES // len(state.names), state.checks)
    if not np.isfinite(shares).all():
        return state
    lagged, tested = state.lagged.copy(), state.tested.copy()
    tested[j] += 1
    lagged[j] = [_averaged(a, b, int(tested[j])) for a, b in zip(lagged[j], shares, strict=True)]
    return replace(state, lagged=lagged, tested=tested)


def _present(state: Agreement) -> list[int]:
    """The views that are there, those first without which the others agree best."""
    present = np.flatnonzero(np.isfinite(state.own) & (state.recent[-1][1].box[:, 2] > 0))
    return sorted(present.tolist(), key=lambda j: float(state.without[j]))


def _suspects(state: Agreement) -> list[int]:
    """The views without which the others agree about as well as they do without any."""
    present = _present(state)
    return [j for j in present if state.without[j] < APART * state.without[present[0]] + MARGIN]


def _judge(state: Agreement) -> tuple[Finding, ...]:
    findings = []
    for j, name in enumerate(state.names):
        if state.empty[j] >= STEADY:
            lasted = int(state.empty[j]) * EVERY
            findings.append(Finding("empty", j, lasted, f"view {name} has seen nobody for {lasted} frames; others do"))
        elif state.still[j] >= STEADY:
            lasted = int(state.still[j]) * EVERY
            said = f"view {name} is frozen: its silhouette has not changed for {lasted} frames, the others' have"
            findings.append(Finding("frozen", j, lasted, said))
    if untrusted(findings) or state.checks < LEAST or len(_present(state)) < 2:
        return tuple(findings)
    return (*findings, *(_out_of_step(state) or _blamed(state)))


def _out_of_step(state: Agreement) -> list[Finding]:
    """The view whose lag, made up for, lets the outlines agree as well as without it."""
    suspects = _suspects(state)
    if len(suspects) > SUSPECTS or any(state.tested[j] < LEAST_TESTS for j in suspects):
        return []
    j = min(suspects, key=lambda k: float(np.min(state.lagged[k])))
    shares, rest = state.lagged[j], float(state.without[suspects[0]])
    lag, now, best = int(np.argmin(shares)) - LAGS, float(shares[LAGS]), float(np.min(shares))
    said_before = any(f.kind == "out-of-step" and f.view == j for f in state.findings)
    enough = max(LAG_GAIN, EXPLAINED * (now - rest)) * (STAYS if said_before else 1.0)
    if lag == 0 or now - best < enough:
        return []
    frames = f"{abs(lag)} frame{'s' if abs(lag) > 1 else ''} {'late' if lag > 0 else 'early'}"
    said = (
        f"view {state.names[j]} is out of step, {frames}: {_percent(now)} of all outlines has no support, "
        f"{_percent(best)} when that is made up for"
    )
    return [Finding("out-of-step", j, lag, said)]


def _blamed(state: Agreement) -> list[Finding]:
    """The one view without which the others agree; or nobody when the views disagree much."""
    present = _present(state)
    j = present[0]
    own, rest = float(state.own[j]), float(state.without[j])
    clear = len(present) >= 3 and len(_suspects(state)) == 1
    if clear and own >= max(UNSUPPORTED, WORSE * rest):
        if state.tested[j] < LEAST_TESTS:
            return []  # it may be out of step
        said = (
            f"view {state.names[j]} disagrees with the others: {_percent(own)} of its outline has no support"
            f" (others {_percent(rest)}): its calibration or its place is wrong"
        )
        return [Finding("calibration", j, own, said)]
    overall = float(np.mean(state.own[present]))
    if overall >= NOBODY_FITS:
        said = f"the views disagree: {_percent(overall)} of their outlines has no support; no one view explains it"
        return [Finding("disagreement", -1, overall, said)]
    return []


def _averaged(average: float, value: float, count: int) -> float:
    """The mean of the first `count` values, then one that forgets."""
    return value if not np.isfinite(average) else average + (value - average) / min(count, MEMORY)


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"
