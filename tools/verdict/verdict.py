"""The verdict on a take: classes of its stretches and of the whole, with reasons."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from zenocap.common import messages as m
from zenocap.common.recording.reader import Take
from zenocap.common.topics import (
    BOTH_WAYS_POSE,
    CAMERA,
    SILHOUETTE,
    TRACKER_BDP,
    TRACKER_POSE,
    UNIVERSAL_BAP,
    UNIVERSAL_BDP,
    VERDICT,
)
from zenocap.tools.verdict.evidence import Evidence
from zenocap.tools.verdict.features import Stretch, stretches_of
from zenocap.tools.verdict.parameters import (
    CLEAR_SHARE,
    GOOD_EXPECTED_M,
    GOOD_LOST,
    LOST_ERROR_M,
    UNUSABLE_EXPECTED_M,
    UNUSABLE_LOST,
)
from zenocap.tools.verdict.reasons import clear_faults, kinds_of, reasons_of
from zenocap.tools.verdict.score import contributions, expected_errors
from zenocap.tools.verdict.view_lag import view_lags

USED = (CAMERA, SILHOUETTE, TRACKER_BDP, TRACKER_POSE, BOTH_WAYS_POSE, UNIVERSAL_BDP, UNIVERSAL_BAP)  # topics
ROUND = 4  # decimals of a stored error, m: 0.1 mm
EvidenceKind = Literal["both-ways", "one-pass", "two-view", "poses-only", "none"]


def verdict_of(evidence: Evidence) -> m.Verdict:
    """The verdict on the messages of a take; equal evidence gives an equal verdict."""
    stretches = stretches_of(evidence)
    last_ns = max(evidence.poses, default=0)
    frame = evidence.poses[last_ns].frame if evidence.poses else 0
    if not stretches:
        lags = view_lags(evidence)
        return m.Verdict(
            frame=frame, captured_ns=last_ns, rating="unusable", error=LOST_ERROR_M, evidence="none",
            reasons=[*([] if lags is None else [lags.reason]), _no_pose(evidence)], stretches=[],
        )  # fmt: skip
    kind = kind_of(evidence)
    errors = np.round(expected_errors(kind, stretches), ROUND)
    terms = contributions(kind, stretches)
    rating = rating_of(kind, stretches, float(errors.mean()))
    start_ns = min((one.captured_ns for one in evidence.cameras.values()), default=stretches[0].start_ns)
    reasons = [] if rating == "good" else reasons_of(kind, terms, stretches, start_ns, view_lags(evidence))
    if kind == "poses-only":
        text = "the take has no silhouettes: the poses cannot be compared with the videos; record silhouettes"
        reasons.insert(0, m.VerdictReason(kind="no-silhouettes", text=text))
    kinds = kinds_of(kind, terms, stretches)
    parts = []
    for one, error, found in zip(stretches, errors.tolist(), kinds, strict=True):
        own = rating_of(kind, [one], error)
        parts.append(
            m.VerdictStretch(
                start_ns=one.start_ns,
                end_ns=one.end_ns,
                rating=own,
                error=error,
                lost=round(one.without_pose, 3),
                reasons=[] if own == "good" else found,
            )
        )
    return m.Verdict(
        frame=frame, captured_ns=last_ns, rating=rating, error=round(float(errors.mean()), ROUND), evidence=kind,
        reasons=reasons, stretches=parts,
    )  # fmt: skip


def kind_of(evidence: Evidence) -> EvidenceKind:
    """Basis of a verdict."""
    if not any(sample.pose_ns is not None and sample.silhouettes for sample in evidence.samples.values()):
        return "poses-only"
    if evidence.both:
        return "both-ways"
    return "two-view" if evidence.tracker_body is None else "one-pass"


def rating_of(kind: str, stretches: Iterable[Stretch], error: float) -> m.Rating:
    """Class of stretches.  error: mean of their expected errors, metres."""
    every = list(stretches)
    lost = float(np.mean([one.without_pose for one in every]))
    if error > UNUSABLE_EXPECTED_M or lost > UNUSABLE_LOST:
        return "unusable"
    clear = np.any(list(clear_faults(every).values()), axis=0)
    good = error <= GOOD_EXPECTED_M and lost <= GOOD_LOST and float(clear.mean()) <= CLEAR_SHARE and kind != "poses-only"
    return "good" if good else "doubtful"


def _no_pose(evidence: Evidence) -> m.VerdictReason:
    if evidence.body is None and evidence.cameras:
        text = (
            "no pose: no person was found that two cameras or more see at a time: the empty scene (empty_frames), the "
            "calibration, swapped videos, and for two-view the T-pose"
        )
    else:
        text = "no pose"
    return m.VerdictReason(kind="no-pose", viewers=[], text=text)


@dataclass(frozen=True)
class TakeVerdict:
    """verdict: of a take.  stored: whether it is in the take, else it was computed now."""

    verdict: m.Verdict
    stored: bool


def evidence_in(path: Path) -> Evidence:
    """Evidence of the messages of a take, whether or not it has a verdict.  Raises UserError for a file that is no take."""
    evidence = Evidence()
    for received in Take(path).envelopes(USED):
        evidence.add(received.message)
    return evidence


def verdict_in(path: Path) -> TakeVerdict:
    """The verdict that a take has, or else that on its messages.  Raises UserError for a file that is no take."""
    evidence = Evidence()
    for received in Take(path).envelopes((*USED, VERDICT)):
        if isinstance(received.message, m.Verdict):
            return TakeVerdict(received.message, stored=True)
        evidence.add(received.message)
    return TakeVerdict(verdict_of(evidence), stored=False)
