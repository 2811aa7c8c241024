"""The verdict against the true error: simulated people with faults, fitted and checked on different people and motions.

    python -m benchmarks.verdict [--fit | --lags] [--kind both-ways ...] [--method two-view] [--shots N]

Silhouettes of 320 x 240, 25 frames/s, two to four cameras, with ragged edges and one fault each; tracked both ways, 4 s of
motion after the T-pose.  good: mean error of the joints up to 75 mm and up to 5 % lost, in truth; unusable: no pose, above
150 mm, or more than 25 % lost.  score: expected error, mm.  --fit prints the coefficients of tools/verdict/parameters.py.
--method two-view: takes of two-view, of the trials with two cameras.  lags: of views, stated as a reason.
Takes are kept in the folder of --folder; a first run tracks them (some 20 minutes on one core).
"""

import argparse
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import cv2
from scipy.stats import spearmanr

from benchmarks.clips import SHARED
from benchmarks.table import Cell, table
from benchmarks.takes import default_folder
from benchmarks.verdict.faults import FAULTS, LATE
from benchmarks.verdict.fit import baseline, fitted
from benchmarks.verdict.lags import COLUMNS, lag_rows
from benchmarks.verdict.takes import Method, fitting, held_out, taken
from benchmarks.verdict.truth import CLASSES, Judged, evidence_for, judged
from zenocap.common import messages as m
from zenocap.tools.verdict.verdict import KINDS, verdict_of

LAG = "than its times say"  # in the text of a reason that states a lag


def confusion(every: Sequence[tuple[Judged, m.Verdict]]) -> list[list[Cell]]:
    """One row per true class: number of takes by verdict."""
    counts = Counter((one.truth.rating, verdict.rating) for one, verdict in every)
    return [[f"{true} in truth", *(counts[true, found] for found in CLASSES)] for true in CLASSES]


def by_fault(every: Sequence[tuple[Judged, m.Verdict]]) -> list[list[Cell]]:
    rows: list[list[Cell]] = []
    for fault in FAULTS:
        own = [(one, verdict) for one, verdict in every if one.take.trial.fault == fault]
        if own:
            true = Counter(one.truth.rating for one, _ in own)
            found = Counter(verdict.rating for _, verdict in own)
            worse = [one.truth.rating for one, verdict in own if verdict.rating == "good" and one.truth.rating != "good"]
            alarms = [1 for one, verdict in own if verdict.rating != "good" and one.truth.rating == "good"]
            shares = (" / ".join(str(counts[name]) for name in CLASSES) for counts in (true, found))
            rows.append([fault, len(own), *shares, len(worse), len(alarms)])
    return rows


def summary(every: Sequence[tuple[Judged, m.Verdict]]) -> str:
    """Hits, false alarms and rank correlation in one line each."""
    bad = [verdict for one, verdict in every if one.truth.rating != "good"]
    good = [verdict for one, verdict in every if one.truth.rating == "good"]
    plain = [verdict for one, verdict in every if one.truth.rating == "good" and one.take.trial.fault == "none"]
    unusable = [verdict for one, verdict in every if one.truth.rating == "unusable"]
    scores = [verdict.error for _, verdict in every]
    errors = [float(one.truth.frames.mean()) for one, _ in every]
    return "\n".join([
        f"hits: {sum(v.rating != 'good' for v in bad)} of {len(bad)} takes that are not good are not called good",
        f"unusable called good: {sum(v.rating == 'good' for v in unusable)} of {len(unusable)}; "
        f"called unusable: {sum(v.rating == 'unusable' for v in unusable)}",
        f"false alarms: {sum(v.rating != 'good' for v in good)} of {len(good)} good takes, "
        f"{sum(v.rating != 'good' for v in plain)} of the {len(plain)} good ones without a fault",
        stated_lags(every),
        f"rank correlation of score and true error (Spearman): {spearmanr(scores, errors)[0]:.2f}, {len(every)} takes",
    ])  # fmt: skip


def stated_lags(every: Sequence[tuple[Judged, m.Verdict]]) -> str:
    """How many takes with a late video, and with another fault, are not good and have a reason with a lag."""
    counts: Counter[bool] = Counter()
    stated: Counter[bool] = Counter()
    for one, verdict in every:
        late = one.take.trial.fault == LATE
        counts[late] += verdict.rating != "good"
        stated[late] += any(LAG in reason.text for reason in verdict.reasons)
    return (
        f"lags stated: {stated[True]} of {counts[True]} takes with a late video, {stated[False]} of {counts[False]} others"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fit", action="store_true")
    parser.add_argument("--kind", nargs="+", choices=KINDS, help="default both-ways, of two-view takes two-view")
    parser.add_argument("--method", choices=("hybrid", "two-view"), default="hybrid")
    parser.add_argument("--lags", action="store_true", help="only lags of views, of takes without a fault")
    parser.add_argument("--shots", type=int, help="people with faults (default all); then without the other people")
    parser.add_argument("--folder", type=Path, default=default_folder())
    options = parser.parse_args()
    if not (SHARED / "motions").is_dir():
        print(f"verdict: skipped: {SHARED / 'motions'} missing (expected beside the checkout)")
        return
    cv2.setNumThreads(1)
    method: Method = options.method
    if options.lags:
        plain = [trial for trial in held_out(options.shots) if trial.fault == next(iter(FAULTS))]
        rows = lag_rows([taken(trial, options.folder) for trial in plain])
        print(table("Lags of one view, as the verdict states them", COLUMNS, rows))
        return
    for kind in options.kind or ["both-ways" if method == "hybrid" else "two-view"]:
        if options.fit:
            every = [judged(taken(trial, options.folder, method), kind) for trial in fitting(options.shots, method)]
            constant, coefficients = fitted(kind, every)
            print(f"{kind}: constant {constant}, coefficients {coefficients}\nbaseline {baseline(coefficients, every)}")
        found = []
        for trial in held_out(options.shots, method):
            take = taken(trial, options.folder, method)
            found.append((judged(take, kind), verdict_of(evidence_for(take, kind))))
        print(table(f"Verdict on other people and motions, {kind}", ("takes", *CLASSES), confusion(found)))
        print(f"\n{summary(found)}")
        classes = "/".join(CLASSES)
        columns = ("fault", "takes", f"truth {classes}", f"verdict {classes}", "missed", "false alarms")
        print(table(f"By fault, {kind}", columns, by_fault(found)))


if __name__ == "__main__":
    main()
