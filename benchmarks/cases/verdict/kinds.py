"""The verdict against the true error: simulated people with faults, other people and motions than those of the fit.

good: mean error of the joints up to 75 mm and up to 5 % lost, in truth; unusable: no pose, above 150 mm, or more than 25 %
lost.  Silhouettes of 320 x 240, 25 frames/s, two to four cameras, with ragged edges and one fault each.
"""

from collections import Counter
from collections.abc import Sequence

from scipy.stats import spearmanr

from benchmarks.cases.verdict.faults import FAULTS
from benchmarks.cases.verdict.takes import MOTIONS, Trial, shots, taken, trial_of, trials
from benchmarks.cases.verdict.truth import CLASSES, Judged, evidence_for, judged
from benchmarks.harness.case import Case, Column, Figures, Kind, case
from benchmarks.people.films import motion_file
from zenocap.common import messages as m
from zenocap.tools.verdict.verdict import verdict_of

ALL = "all"
PAIRS = tuple((true, found) for true in CLASSES for found in CLASSES)
CLASS_COLUMNS = tuple(Column(f"{true} in truth, called {found}", "takes", 0, "", "sum") for true, found in PAIRS)
EVIDENCE = {"hybrid": "both-ways", "two-view": "two-view"}


def run(one: Case) -> Figures:
    """Verdicts on takes: of one shot with a fault, the film, or of all trials.  Options: method, evidence."""
    method = one.option("method", "hybrid")
    chosen = trials(method) if one.film == ALL else [trial_of(shots(method)[one.seed], one.film)]
    return figures([_judged(trial, method, one.option("evidence", EVIDENCE[method])) for trial in chosen])


def _judged(trial: Trial, method: str, evidence: str) -> tuple[Judged, m.Verdict]:
    take = taken(trial, method)
    return judged(take, evidence), verdict_of(evidence_for(take, evidence))


def figures(every: Sequence[tuple[Judged, m.Verdict]]) -> dict[str, float]:
    counts = Counter((one.truth.rating, verdict.rating) for one, verdict in every)
    found = {f"{true} in truth, called {given}": float(counts[true, given]) for true, given in PAIRS if counts[true, given]}
    if len(every) > 2:
        errors = [float(one.truth.frames.mean()) for one, _ in every]
        found["rank correlation"] = float(spearmanr([verdict.error for _, verdict in every], errors)[0])
        plain = [verdict for one, verdict in every if one.truth.rating == "good" and one.take.trial.fault == "none"]
        found["good without fault"] = len(plain)
        found["of them called good"] = sum(verdict.rating == "good" for verdict in plain)
    return found


VERDICT = Kind(
    "verdict",
    "The verdict on 220 takes of simulated people with injected faults, tracked both ways: takes by their class in truth "
    "and the one that they are called.",
    run,
    (
        *CLASS_COLUMNS,
        Column("rank correlation", "", 2, "low"),
        *(Column(name, "takes", 0, "") for name in ("good without fault", "of them called good")),
    ),
    {"takes of hybrid": case(ALL), "takes of two-view": case(ALL, method="two-view")},
    case("none"),
    seeds=1,
    rows="takes",
    inputs=lambda _: tuple(map(motion_file, MOTIONS)),
)
BY_FAULT = Kind(
    "verdict-faults",
    "The same by fault, twelve takes of each.",
    run,
    CLASS_COLUMNS,
    {fault: case(fault) for fault in FAULTS},
    case("none"),
    seeds=12,
    rows="fault",
    inputs=VERDICT.inputs,
)
