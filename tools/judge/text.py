"""Texts of a verdict: its parts, and its reasons with figures, cameras and what to change.

In the text of a reason `{share}` stands for the share of the time in which it holds, `{cause}` for that of a contradiction.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import astuple
from functools import partial
from itertools import groupby

import numpy as np

from zenocap.common import messages as m
from zenocap.tools.judge.features import COLUMN, Apart, Stretch
from zenocap.tools.judge.parameters import CAUSE_SAMPLES, GROWS, NOTABLE_VIEW, STAYS

Text = tuple[list[str], str]  # viewers, text
SHOWN_PARTS = 10  # of a take that are less than good
EVIDENCE = {
    "both-ways": "poses of both passes, silhouettes", "one-pass": "poses of one pass, silhouettes",
    "two-view": "poses of two-view, silhouettes", "poses-only": "poses alone", "none": "nothing",
}  # fmt: skip


def part_lines(verdict: m.Verdict, start_ns: int) -> Iterator[str]:
    """A line for every part of a take that is less than good.  start_ns: of the take, from which seconds count."""
    parts = []
    for (rating, reasons), group in groupby(verdict.stretches, key=lambda one: (one.rating, tuple(one.reasons[:2]))):
        stretches = list(group)
        if rating != "good":
            error = sum(one.error for one in stretches) / len(stretches)
            times = f"{(stretches[0].start_ns - start_ns) / 1e9:7.1f} to {(stretches[-1].end_ns - start_ns) / 1e9:.1f} s"
            parts.append(f"{times}: {rating}, {1000 * error:.0f} mm: {', '.join(reasons) or '-'}")
    yield from parts[:SHOWN_PARTS]
    if len(parts) > SHOWN_PARTS:
        yield f"  and {len(parts) - SHOWN_PARTS} more parts: --json"


def _worst(stretches: Sequence[Stretch], figure: Callable[[Stretch, str], float]) -> tuple[dict[str, float], list[str]]:
    """Mean figure by viewer, and the viewers that stand out, the worst first."""
    names = sorted({viewer for one in stretches for viewer in one.views})
    means = {}
    for name in names:
        values = np.array([figure(one, name) for one in stretches if name in one.views])
        means[name] = float(np.nanmean(values)) if np.isfinite(values).any() else 0.0
    order = sorted(names, key=lambda name: -means[name])
    return means, [name for name in order if means[name] >= NOTABLE_VIEW * means[order[0]]]


def _cameras(names: Sequence[str]) -> str:
    return f"camera {names[0]}" if len(names) == 1 else f"cameras {', '.join(names)}"


def _mean(stretches: Sequence[Stretch], name: str) -> float:
    values = np.array([one.values[COLUMN[name]] for one in stretches])
    return float(np.nanmean(values)) if np.isfinite(values).any() else 0.0


def _overlap(stretches: Sequence[Stretch]) -> Text:
    outside, _ = _worst(stretches, lambda one, name: one.views[name].outside)
    bare, _ = _worst(stretches, lambda one, name: one.views[name].uncovered)
    both, worst = _worst(stretches, lambda one, name: one.views[name].outside + one.views[name].uncovered)
    if not both:
        return [], "body and silhouettes do not cover each other{share}"
    name = worst[0]
    why = "shadow, second person, someone in the empty scene (empty_seconds) or other things in the silhouette"
    if outside[name] < bare[name]:
        why = "parts of the person missing in the silhouette (contrast)"
    return worst, (
        f"{_cameras(worst)}: {100 * outside[name]:.0f} % of the silhouette outside the body, {100 * bare[name]:.0f} % of "
        f"the body outside the silhouette{{share}}: {why}, wrong calibration, a moved camera, swapped or late videos"
    )


def _tangents(stretches: Sequence[Stretch], figure: Callable[[Apart], float]) -> tuple[dict[str, float], list[str]]:
    """As `_worst`, of a figure of the tangents."""
    return _worst(stretches, lambda one, name: figure(one.apart[name]) if name in one.apart else float("nan"))


def _apart(stretches: Sequence[Stretch]) -> Text:
    means, worst = _tangents(stretches, lambda one: one.distance)
    if not worst:
        return [], "the views contradict each other{share}"
    who = f"{_cameras(worst)} contradict{'s' if len(worst) == 1 else ''} the others"
    if len(means) == 2:
        who = f"cameras {' and '.join(sorted(means))} contradict each other"
    return worst, f"{who} by {means[worst[0]]:.1f} px at the head{{share}}: {{cause}}"


def contradiction_cause(stretches: Sequence[Stretch]) -> str:
    """Of a contradiction: a wrong calibration makes one that stays, wrong times one that grows with the speed."""
    _, worst = _tangents(stretches, lambda one: one.distance)
    own = np.nan_to_num([astuple(one.apart[worst[0]]) for one in stretches if worst[0] in one.apart])
    _, higher, _, square, along, speed = own.mean(axis=0)
    possible = abs(along) < CAUSE_SAMPLES * speed  # as a lag
    stays, grows = higher**2 / max(square, 1e-9), possible * along**2 / max(square * speed, 1e-9)
    place = "wrong calibration, a camera that was moved, or swapped videos"
    times = "videos that began at different times, or clocks that differ (zenocap sync)"
    if stays > STAYS and grows < GROWS:
        return place
    return times if grows > GROWS and stays < GROWS else f"{place}; {times}; or poor silhouettes (contrast)"


def _feet(stretches: Sequence[Stretch]) -> Text:
    low, worst = _tangents(stretches, lambda one: -one.feet)
    highest = min(low, key=lambda name: low[name])
    if -low[highest] > low[worst[0]]:  # alone: of two cameras the lower one is named
        why = "the feet are missing: contrast of shoes and floor"
        return [highest], f"lower edges of camera {highest} are {-low[highest]:.1f} px high{{share}}: {why}"
    why = "shadow or mirror image at the feet: softer light from above, a matt floor"
    return worst, f"lower edges of {_cameras(worst)} are {low[worst[0]]:.1f} px low{{share}}: {why}"


def _cut(stretches: Sequence[Stretch]) -> Text:
    _, worst = _worst(stretches, lambda one, name: float(one.views[name].cut) + one.views[name].hidden)
    return worst, f"{_cameras(worst)}: the person is partly outside the image{{share}}: move the camera back, or turn it"


def _missing(stretches: Sequence[Stretch]) -> Text:
    _, worst = _worst(stretches, lambda one, name: float(one.views[name].area < 1e-3))
    share = max(_mean(stretches, "empty"), _mean(stretches, "unused"))
    return worst if len(worst) < 3 else [], (
        f"{100 * share:.0f} % of the views show no person, or were left out because they contradict the others{{share}}: "
        "zenocap doctor, and the calibration of that camera"
    )


def _jumps(stretches: Sequence[Stretch]) -> Text:
    value = _mean(stretches, "jumps")
    figure = f"{100 * value:.0f} % of the steps are faster than a person" if value > 0.01 else "the joints shake"
    return [], f"{figure}{{share}}: more cameras, or a higher frame rate"


def _figure(name: str, factor: float, text: str, stretches: Sequence[Stretch]) -> Text:
    """A text with the mean of a figure, in its unit there: multiplied by a factor."""
    return [], text.format(factor * _mean(stretches, name))


TEXTS: Mapping[str, Callable[[Sequence[Stretch]], Text]] = {
    "overlap": _overlap, "views-apart": _apart, "feet": _feet, "cut": _cut, "view-missing": _missing, "jumps": _jumps,
    "limbs": partial(
        _figure, "worst limb", 100, "an arm or a leg is wrong with a probability of {:.0f} %{{share}}: more cameras"
    ),
    "heading": partial(
        _figure, "heading", 100, "front and back may be exchanged (probability {:.0f} %){{share}}: show the feet"
    ),
    "passes": partial(
        _figure, "passes", 1000, "the passes forwards and backwards differ by {:.0f} mm{{share}}: more cameras"
    ),
    "limits": partial(
        _figure, "limits", 100,
        "{:.0f} % of the joint angles are at their limits{{share}}: exchanged limbs, wrong calibration",
    ),
    "average-body": lambda _: (
        [], "no T-pose was seen: the body has average proportions: begin with both arms stretched sideways"
    ),
    "few-views": lambda _: ([], "two cameras leave depth and hidden limbs open: a third one, from another side"),
}  # fmt: skip
