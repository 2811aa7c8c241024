"""Verdict on a take: expected error of the joints, classes of its stretches and of the whole, reasons.

The error of a stretch is a monotone log-linear model of its figures, each of which can only raise it,

    ln error = constant + sum over the features of coefficient * ln(1 + min(value, largest) / scale)

so that the share of each feature in the error is its term.  Frames without a pose count as LOST_ERROR_M.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from zenocap.common import messages as m
from zenocap.common import topics
from zenocap.common.arrays import Floats
from zenocap.common.recording.reader import TakeReader
from zenocap.tools.judge import parameters as p
from zenocap.tools.judge.evidence import TakeEvidence, evidence_of
from zenocap.tools.judge.features import FEATURES, Stretch, stretches_of
from zenocap.tools.judge.reasons import clear_faults, kinds_of, reasons_of
from zenocap.tools.judge.rig_faults import no_pose, rig_fault
from zenocap.tools.judge.seen import LEFT_OUT, half_person, scene_reasons, unsteady
from zenocap.tools.judge.view_lag import view_lags

USED = (
    topics.CAMERA, topics.CAMERA_ADVICE, topics.SILHOUETTE, topics.TRACKER_BDP, topics.TRACKER_POSE, topics.BOTH_WAYS_POSE,
    topics.UNIVERSAL_BDP, topics.UNIVERSAL_BAP,
)  # fmt: skip
ROUND = 4  # decimals of a stored error, m: 0.1 mm
EvidenceKind = Literal["both-ways", "one-pass", "two-view", "poses-only", "none"]
KINDS = ("both-ways", "one-pass", "two-view", "poses-only")  # of evidence; each has coefficients of its own
LOST = FEATURES.index("lost")


def verdict_of(evidence: TakeEvidence) -> m.Verdict:
    """The verdict on the messages of a take; equal evidence gives an equal verdict."""
    evidence = evidence.live()
    stretches = stretches_of(evidence)
    last_ns = max(evidence.poses, default=0)
    frame = evidence.poses[last_ns].frame if evidence.poses else 0
    start_ns = min((one.captured_ns for one in evidence.cameras.values()), default=min(evidence.poses, default=0))
    frozen = list(evidence.repeated.reasons(start_ns, last_ns))
    if not stretches:
        return m.Verdict(
            frame=frame, captured_ns=last_ns, rating="unusable", error=p.LOST_ERROR_M, evidence="none",
            reasons=[*(one for _, one in frozen), *no_pose(evidence, view_lags(evidence))], stretches=[],
        )  # fmt: skip
    kind = kind_of(evidence)
    errors = np.round(expected_errors(kind, stretches), ROUND)
    terms = contributions(kind, stretches)
    half = half_person(evidence)
    rating = rating_of(kind, stretches, float(errors.mean())) if half is None else "unusable"
    reasons = []
    if rating != "good":
        lags = view_lags(evidence)
        fault = None if half or lags or rating != "unusable" else unsteady(evidence) or rig_fault(evidence)
        many = [] if lags else scene_reasons(evidence, LEFT_OUT, p.MANY_OCCUPIED)
        long, short = [one for much, one in frozen if much], [one for much, one in frozen if not much]
        causes = [one for one in (*long, half, *scene_reasons(evidence), fault, *many) if one is not None]
        few = [*([] if many else scene_reasons(evidence, LEFT_OUT)), *short]
        reasons = [*causes, *reasons_of(kind, terms, stretches, start_ns, lags), *few]
    if kind == "poses-only":
        text = "the take has no silhouettes: the poses cannot be compared with the videos; record silhouettes"
        reasons.insert(0, m.VerdictReason(kind="no-silhouettes", text=text))
    kinds = kinds_of(kind, terms, stretches)
    parts = []
    for one, error, found in zip(stretches, errors.tolist(), kinds, strict=True):
        own = rating_of(kind, [one], error)
        part = m.VerdictStretch(
            start_ns=one.start_ns, end_ns=one.end_ns, rating=own, error=error, lost=round(one.without_pose, 3),
            reasons=[] if own == "good" else found,
        )  # fmt: skip
        parts.append(part)
    return m.Verdict(
        frame=frame, captured_ns=last_ns, rating=rating, error=round(float(errors.mean()), ROUND), evidence=kind,
        reasons=reasons, stretches=parts,
    )  # fmt: skip


def kind_of(evidence: TakeEvidence) -> EvidenceKind:
    """What a verdict rests on."""
    if not any(sample.pose_ns is not None and sample.silhouettes for sample in evidence.samples.values()):
        return "poses-only"
    if evidence.both:
        return "both-ways"
    return "two-view" if evidence.tracker_body is None else "one-pass"


def rating_of(kind: str, stretches: Iterable[Stretch], error: float) -> m.Rating:
    """Class of stretches.  error: mean of their expected errors, metres."""
    every = list(stretches)
    lost = float(np.mean([one.without_pose for one in every]))
    if error > p.UNUSABLE_EXPECTED_M or lost > p.UNUSABLE_LOST:
        return "unusable"
    clear = np.any(list(clear_faults(every).values()), axis=0)
    known = kind != "poses-only" and float(clear.mean()) <= p.CLEAR_SHARE
    good = known and error <= p.GOOD_EXPECTED_M and lost <= p.GOOD_LOST
    return "good" if good else "doubtful"


def evidence_in(path: Path) -> TakeEvidence:
    """Evidence of the messages of a take, whether or not it has a verdict.  Raises UserError for a file that is no take."""
    return evidence_of(received.message for received in TakeReader(path).envelopes(USED))


def verdict_in(path: Path) -> m.Verdict:
    """The verdict that a take has, or else that on its messages.  Raises UserError for a file that is no take."""
    evidence = TakeEvidence()
    for received in TakeReader(path).envelopes((*USED, topics.VERDICT)):
        if isinstance(received.message, m.Verdict):
            return received.message
        evidence.add(received.message)
    return verdict_of(evidence)


def terms(values: Floats) -> Floats:
    """(n, FEATURES) of figures (n, FEATURES), without coefficients; 0 where unknown, for "lost" and "missing"."""
    scale, largest = np.array([p.SCALES.get(name, (1.0, 0.0)) for name in FEATURES]).T
    found: Floats = np.nan_to_num(np.log1p(np.clip(values, 0.0, largest) / scale), nan=0.0)
    return found


def contributions(kind: str, stretches: Sequence[Stretch]) -> Floats:
    """(n, FEATURES) terms of ln error of n stretches."""
    coefficients: Mapping[str, float] = p.COEFFICIENTS[kind]
    weights = np.array([coefficients.get(name, 0.0) for name in FEATURES])
    found: Floats = terms(np.stack([one.values for one in stretches])) * weights
    return found


def expected_errors(kind: str, stretches: Sequence[Stretch]) -> Floats:
    """(n,) expected mean errors of the joints, metres."""
    tracked = np.minimum(p.LOST_ERROR_M, 1e-3 * np.exp(p.CONSTANTS[kind] + contributions(kind, stretches).sum(axis=1)))
    lost = np.array([one.values[LOST] for one in stretches])
    found: Floats = lost * p.LOST_ERROR_M + (1.0 - lost) * tracked
    return found
