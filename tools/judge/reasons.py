"""Reasons of a verdict: groups of features that raise the expected error."""

from collections.abc import Mapping, Sequence

import numpy as np

from zenocap.common import messages as m
from zenocap.common.arrays import Bools, Floats
from zenocap.tools.judge import parameters as p
from zenocap.tools.judge.features import COLUMN, FEATURES, Stretch
from zenocap.tools.judge.text import TEXTS, contradiction_cause
from zenocap.tools.judge.view_lag import ViewLags

GROUPS: Mapping[str, tuple[str, ...]] = {  # kind of reason: features
    "overlap": ("outside", "outside, all views", "uncovered", "uncovered, all views"),
    "views-apart": ("apart",),
    "cut": ("cut", "hidden"),
    "view-missing": ("empty", "unused"),
    "limbs": ("limbs", "worst limb"),
    "heading": ("heading",),
    "jumps": ("jumps", "shaking"),
    "passes": ("passes",),
    "limits": ("limits",),
    "average-body": ("average body",),
    "few-views": ("few views",),
}
CLEAR: Mapping[str, tuple[str, float]] = {  # kind of reason: figure beyond which a stretch is not good in any case
    "overlap": ("outside", p.CLEAR_OUTSIDE),
    "uncovered": ("uncovered", p.CLEAR_UNCOVERED),
    "views-apart": ("apart", p.CLEAR_APART),
}
SYMPTOMS = ("limits", "lost", "heading")  # kinds of reasons that follow from silhouettes that do not fit


def clear_faults(stretches: Sequence[Stretch]) -> dict[str, Bools]:
    """By kind: (n,) stretches with a figure that is clearly wrong, whatever the expected error."""
    values = np.stack([one.values for one in stretches])
    found: dict[str, Bools] = {}
    for kind, (name, limit) in CLEAR.items():
        wrong = np.nan_to_num(values[:, COLUMN[name]], nan=0.0) > limit
        kind = "overlap" if kind == "uncovered" else kind
        found[kind] = found.get(kind, np.zeros(len(values), dtype=bool)) | wrong
    return found


def raised(kind: str, terms: Floats, stretches: Sequence[Stretch]) -> dict[str, Floats]:
    """By kind: (n,) what the features of a group add to ln error, over what they add in a good take.

    Views are not apart by what edges of silhouettes explain.
    """
    baseline = np.array([p.BASELINE[kind].get(name, 0.0) for name in FEATURES])
    found = {
        group: np.maximum(0.0, (terms - baseline)[:, [COLUMN[name] for name in names]].sum(axis=1))
        for group, names in GROUPS.items()
    }
    found["views-apart"][[not one.values[COLUMN["apart"]] > p.NOTED_APART for one in stretches]] = 0.0
    return found


def _feet_apart(stretches: Sequence[Stretch]) -> Floats:
    """(n,) weight of views that contradict each other at the feet alone; it makes no take less than good."""
    columns = [COLUMN["feet apart"], COLUMN["apart"]]
    feet, others = np.nan_to_num(np.stack([one.values[columns] for one in stretches])).T
    return np.where((feet - others > p.NOTED_FEET) & (others < p.CLEAR_APART), p.FEET_WEIGHT, 0.0)


def kinds_of(evidence: str, terms: Floats, stretches: Sequence[Stretch]) -> list[list[str]]:
    """Kinds of reasons of each stretch, the weightiest first."""
    clear, more = clear_faults(stretches), raised(evidence, terms, stretches)
    found = []
    for k, stretch in enumerate(stretches):
        weights = {kind: float(values[k]) for kind, values in more.items()}
        for kind, wrong in clear.items():
            weights[kind] += float(wrong[k])
        if stretch.without_pose > 0.0:
            weights["lost"] = 1.0 + stretch.without_pose
        order = sorted((kind for kind, weight in weights.items() if weight > p.NOTABLE), key=lambda kind: -weights[kind])
        found.append(order[: p.MOST_REASONS])
    return found


def reasons_of(
    evidence: str, terms: Floats, stretches: Sequence[Stretch], start_ns: int, lags: ViewLags | None
) -> list[m.VerdictReason]:
    """Reasons of a take that is not good, one or more, the weightiest first: by their share of ln error, and 1 for a figure
    that is clearly wrong.  SYMPTOMS come after what is clearly wrong in much of the time, which causes them.

    start_ns: capture time of frame 0.  lags: of views, which explain that they contradict each other.
    """
    clear, more = clear_faults(stretches), raised(evidence, terms, stretches) | {"feet": _feet_apart(stretches)}
    found: list[tuple[float, m.VerdictReason]] = []  # with their weights
    if lags is not None:
        found.append((p.LAG_WEIGHT, lags.reason))
    for kind, values in more.items():
        if lags is not None and kind == lags.reason.kind:
            continue
        wrong = clear.get(kind, np.zeros(len(stretches), dtype=bool))
        weight = float(values.mean()) + float(wrong.mean())
        at = wrong | (values > p.NOTABLE)
        if weight > 0.0:
            some = [one for one, there in zip(stretches, at, strict=True) if there] or list(stretches)
            viewers, text = TEXTS[kind](some)
            share = f", in {100 * at.mean():.0f} % of the time" if 0.0 < at.mean() < p.SHOWN_SHARE else ""
            cause = contradiction_cause(stretches) if "{cause}" in text else ""
            text = text.replace("{share}", share).replace("{cause}", cause)
            reason = m.VerdictReason(kind=kind, viewers=viewers, text=text)
            found.append((weight, reason))
    lost = _lost_reason(stretches, start_ns)
    if lost is not None:
        found.append(lost)
    causes = [weight for weight, one in found if one.kind in clear and float(clear[one.kind].mean()) > p.CLEAR_SHARE]
    if causes:  # before what follows from it; the sort is stable
        found = [(min(weight, max(causes)) if one.kind in SYMPTOMS else weight, one) for weight, one in found]
    found.sort(key=lambda one: -one[0])
    notable = [reason for weight, reason in found if weight > p.NOTABLE][: p.MOST_REASONS]
    return notable or [reason for _, reason in found[:1]]


def _lost_reason(stretches: Sequence[Stretch], start_ns: int) -> tuple[float, m.VerdictReason] | None:
    """No pose in some of the time, and the weight of that; None without such a stretch."""
    lost = np.array([one.without_pose for one in stretches])
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
    return weight, m.VerdictReason(kind="lost", text=text)
