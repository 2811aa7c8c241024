"""The verdict against the true error: other people, motions and faults than those of the fit.

good: mean error of the joints up to 75 mm and up to 5 % lost, in truth; unusable: no pose, above 150 mm, or more than 25 %
lost.  Silhouettes of 320 x 240, 25 frames/s, two to four cameras, with ragged edges and one fault each.
"""

from collections import Counter
from collections.abc import Sequence

from scipy.stats import spearmanr

from benchmarks.cases.verdict.faults import FAULTS
from benchmarks.cases.verdict.takes import MOTIONS, FaultTrial, shots, taken, trial_of, trials
from benchmarks.cases.verdict.truth import CLASSES, TrueError, true_error
from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from benchmarks.people.films import motion_file
from zenocap.common import messages as m
from zenocap.tools.judge.evidence import evidence_of
from zenocap.tools.judge.verdict import verdict_of

ALL = "all"
PAIRS = tuple((true, found) for true in CLASSES for found in CLASSES)
CLASS_COLUMNS = tuple(Quantity(f"{true} in truth, called {found}", "takes", 0, "", "sum") for true, found in PAIRS)


def run(one: Case) -> Figures:
    """Verdicts on takes: of one shot with a fault, the film, or of all trials.  Options: method."""
    method = one.option("method", "hybrid")
    chosen = trials(method) if one.film == ALL else [trial_of(shots(method)[one.seed], one.film)]
    every = [_judged(trial, method) for trial in chosen]
    found = figures(every)
    if one.film == ALL:
        errors = [float(true.frames.mean()) for true, _ in every]
        found["rank correlation"] = float(spearmanr([verdict.error for _, verdict in every], errors)[0])
        plain = [(true, verdict) for (true, verdict), trial in zip(every, chosen, strict=True) if trial.fault == "none"]
        good = [verdict for true, verdict in plain if true.rating == "good"]
        found |= {"good without fault": len(good), "of them called good": sum(each.rating == "good" for each in good)}
    return found


def _judged(trial: FaultTrial, method: str) -> tuple[TrueError, m.Verdict]:
    take = taken(trial, method)
    found = evidence_of(take.messages)
    return true_error(take, found), verdict_of(found)


def figures(every: Sequence[tuple[TrueError, m.Verdict]]) -> dict[str, float]:
    """Number of takes by their class in truth and the one that they are called."""
    counts = Counter((true.rating, verdict.rating) for true, verdict in every)
    return {f"{true} in truth, called {given}": float(counts[true, given]) for true, given in PAIRS if counts[true, given]}


VERDICT = Kind(
    "verdict",
    "The verdict on 232 takes of simulated people with injected faults, tracked both ways: takes by their class in truth "
    "and the one that they are called.",
    run,
    (
        *CLASS_COLUMNS,
        Quantity("rank correlation", "", 2, "low"),
        *(Quantity(name, "takes", 0, "") for name in ("good without fault", "of them called good")),
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
