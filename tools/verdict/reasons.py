"""Reasons of a verdict: groups of features that raise the expected error, in words, with what to change."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from zenocap.common import messages as m
from zenocap.common.arrays import Bools, Floats
from zenocap.tools.verdict.features import FEATURES, Stretch
from zenocap.tools.verdict.parameters import (
    BASELINE,
    CLEAR_APART,
    CLEAR_OUTSIDE,
    CLEAR_UNCOVERED,
    MOST_REASONS,
    NOTABLE,
    NOTABLE_VIEW,
    SHOWN_SHARE,
)

GROUPS: Mapping[str, tuple[str, ...]] = {  # kind of reason: features
    "overlap": ("outside", "outside, all views", "uncovered", "uncovered, all views"),
    "views-apart": ("apart",),
    "cut": ("cut", "hidden"),
    "view-missing": ("empty", "unused"),
    "silhouettes": ("pieces", "flicker"),
    "limbs": ("limbs", "worst limb"),
    "heading": ("heading",),
    "jumps": ("jumps", "shaking"),
    "passes": ("passes",),
    "limits": ("limits",),
    "average-body": ("average body",),
    "few-views": ("few views",),
}
CLEAR: Mapping[str, tuple[str, float]] = {  # kind of reason: figure beyond which a stretch is not good in any case
    "overlap": ("outside", CLEAR_OUTSIDE),
    "uncovered": ("uncovered", CLEAR_UNCOVERED),
    "views-apart": ("apart", CLEAR_APART),
}
COLUMN = {name: k for k, name in enumerate(FEATURES)}


@dataclass(frozen=True)
class Found:
    """A reason with its weight: share of ln error, or 1 and more for a figure that is clearly wrong."""

    weight: float
    reason: m.VerdictReason


def clear_faults(stretches: Sequence[Stretch]) -> dict[str, Bools]:
    """By kind: (n,) stretches with a figure that is clearly wrong, whatever the expected error."""
    values = np.stack([one.values for one in stretches])
    found: dict[str, Bools] = {}
    for kind, (name, limit) in CLEAR.items():
        wrong = np.nan_to_num(values[:, COLUMN[name]], nan=0.0) > limit
        kind = "overlap" if kind == "uncovered" else kind
        found[kind] = found.get(kind, np.zeros(len(values), dtype=bool)) | wrong
    return found


def raised(kind: str, terms: Floats) -> dict[str, Floats]:
    """By kind: (n,) what the features of a group add to ln error, over what they add in a good take."""
    baseline = np.array([BASELINE[kind].get(name, 0.0) for name in FEATURES])
    return {
        group: np.maximum(0.0, (terms - baseline)[:, [COLUMN[name] for name in names]].sum(axis=1))
        for group, names in GROUPS.items()
    }


def kinds_of(evidence: str, terms: Floats, stretches: Sequence[Stretch]) -> list[list[str]]:
    """Kinds of reasons of each stretch, the weightiest first."""
    clear, more = clear_faults(stretches), raised(evidence, terms)
    found = []
    for k, stretch in enumerate(stretches):
        weights = {kind: float(values[k]) for kind, values in more.items()}
        for kind, wrong in clear.items():
            weights[kind] += float(wrong[k])
        if stretch.values[COLUMN["lost"]] > 0.0:
            weights["lost"] = 1.0 + float(stretch.values[COLUMN["lost"]])
        order = sorted((kind for kind, weight in weights.items() if weight > NOTABLE), key=lambda kind: -weights[kind])
        found.append(order[:MOST_REASONS])
    return found


def reasons_of(
    evidence: str, terms: Floats, stretches: Sequence[Stretch], start_ns: int, least: int
) -> list[m.VerdictReason]:
    """Reasons of a take, the weightiest first.  start_ns: capture time of frame 0.  least: how many there must be."""
    clear, more = clear_faults(stretches), raised(evidence, terms)
    found: list[Found] = []
    for kind, values in more.items():
        wrong = clear.get(kind, np.zeros(len(stretches), dtype=bool))
        weight = float(values.mean()) + float(wrong.mean())
        at = wrong | (values > NOTABLE)
        if weight > 0.0:
            some = [one for one, there in zip(stretches, at, strict=True) if there] or list(stretches)
            viewers, text = TEXTS[kind](some)
            share = f", in {100 * at.mean():.0f} % of the time" if 0.0 < at.mean() < SHOWN_SHARE else ""
            found.append(Found(weight, m.VerdictReason(kind=kind, viewers=viewers, text=text.replace("{share}", share))))
    lost = lost_reason(stretches, start_ns)
    if lost is not None:
        found.append(lost)
    found.sort(key=lambda one: -one.weight)
    notable = [one.reason for one in found if one.weight > NOTABLE][:MOST_REASONS]
    return notable or [one.reason for one in found[:least]]


def lost_reason(stretches: Sequence[Stretch], start_ns: int) -> Found | None:
    """No pose in some of the time; None without such a stretch."""
    lost = np.array([one.values[COLUMN["lost"]] for one in stretches])
    if not lost.any():
        return None
    k = int(np.argmax(lost))
    first = last = k
    while first > 0 and lost[first - 1] > 0.0:
        first -= 1
    while last + 1 < len(lost) and lost[last + 1] > 0.0:
        last += 1
    begin_s, end_s = (stretches[first].start_ns - start_ns) / 1e9, (stretches[last].end_ns - start_ns) / 1e9
    text = (
        f"no pose in {100 * lost.mean():.0f} % of the time with the person in view, the longest from {begin_s:.1f} to "
        f"{end_s:.1f} s: two cameras must see the whole person; trim the take with --from and --until of other commands"
    )
    weight = 1.0 + float(lost.mean()) if lost.mean() > 0.02 else float(lost.mean())
    return Found(weight, m.VerdictReason(kind="lost", text=text))


Text = tuple[list[str], str]  # viewers, text


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
    if outside[name] >= bare[name]:
        why = "shadow, second person or other things in the silhouette, wrong calibration, swapped or late videos"
    else:
        why = "parts of the person missing in the silhouette (contrast), wrong calibration, swapped or late videos"
    return worst, (
        f"{_cameras(worst)}: {100 * outside[name]:.0f} % of the silhouette outside the body, {100 * bare[name]:.0f} % of "
        f"the body outside the silhouette{{share}}: {why}"
    )


def _apart(stretches: Sequence[Stretch]) -> Text:
    means, worst = _worst(stretches, lambda one, name: one.apart.get(name, float("nan")))
    if not worst:
        return [], "the views contradict each other{share}"
    return worst, (
        f"{_cameras(worst)}: the silhouettes contradict the other cameras by {1000 * means[worst[0]]:.0f} mm at the person"
        "{share}: wrong calibration, a camera that was moved, swapped videos, videos that began at different times "
        "(zenocap sync), or shadows"
    )


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


def _silhouettes(stretches: Sequence[Stretch]) -> Text:
    means, worst = _worst(stretches, lambda one, name: one.views[name].pieces)
    if means and means[worst[0]] > 0.02:
        figure = f"{100 * means[worst[0]]:.0f} % of the silhouette is not connected with the rest"
        return worst, f"{_cameras(worst)}: {figure}{{share}}: contrast to the background, light, other people"
    return (
        [],
        "the area of the silhouettes changes from moment to moment{share}: contrast to the background, changing light",
    )


def _limbs(stretches: Sequence[Stretch]) -> Text:
    value = _mean(stretches, "worst limb")
    return (
        [],
        f"an arm or a leg is wrong with a probability of {100 * value:.0f} %{{share}}: more cameras",
    )


def _heading(stretches: Sequence[Stretch]) -> Text:
    value = _mean(stretches, "heading")
    return (
        [],
        f"front and back may be exchanged (probability {100 * value:.0f} %){{share}}: show the feet",
    )


def _jumps(stretches: Sequence[Stretch]) -> Text:
    value = _mean(stretches, "jumps")
    figure = f"{100 * value:.0f} % of the steps are faster than a person" if value > 0.01 else "the joints shake"
    return [], f"{figure}{{share}}: more cameras, or a higher frame rate"


def _passes(stretches: Sequence[Stretch]) -> Text:
    return (
        [],
        f"the passes forwards and backwards differ by {1000 * _mean(stretches, 'passes'):.0f} mm{{share}}: more cameras",
    )


def _limits(stretches: Sequence[Stretch]) -> Text:
    value = _mean(stretches, "limits")
    return (
        [],
        f"{100 * value:.0f} % of the joint angles are at their limits{{share}}: exchanged limbs, wrong calibration",
    )


def _average_body(stretches: Sequence[Stretch]) -> Text:
    return [], "no T-pose was seen: the body has average proportions: begin with both arms stretched sideways"


def _few_views(stretches: Sequence[Stretch]) -> Text:
    return [], "two cameras leave depth and hidden limbs open: a third one, from another side"


TEXTS: Mapping[str, Callable[[Sequence[Stretch]], Text]] = {
    "overlap": _overlap, "views-apart": _apart, "cut": _cut, "view-missing": _missing, "silhouettes": _silhouettes,
    "limbs": _limbs, "heading": _heading, "jumps": _jumps, "passes": _passes, "limits": _limits,
    "average-body": _average_body, "few-views": _few_views,
}  # fmt: skip
