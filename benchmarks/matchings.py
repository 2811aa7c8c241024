"""Matchings per overlapped tri-tree search, on the searches of the running tracker, and quality of the results.

    python -m benchmarks.matchings [--people N] [--every N]

The paper counts, as mean, maximum and in a full search, 7, 9 and 17 for an arm (64 degrees) and 5.67, 7 and 9 for
a leg (32 degrees).  [Two-view Eq. 2]  These are numbers of one search; a limb has several, see `benchmarks.variants`.
"""

import argparse

import numpy as np

from benchmarks.situations import Situation, record
from benchmarks.table import table
from benchmarks.takes import default_folder, takes
from zenocap.services.viewer.parameters import ARM_REGION, LEG_REGION, STOP
from zenocap.simulation.motion.posture_style import POSTURES

PAPER = {"arm": (7.0, 9, 17), "leg": (5.67, 7, 9)}
NEARLY = 0.002  # difference of matching score within which both results count as equal


def row(limb: str, situations: list[Situation]) -> tuple[str | int | float, ...]:
    trees = [s.tri_tree() for s in situations]
    fulls = [s.full_search(STOP) for s in situations]
    counts = np.array([count for _, _, count in trees])
    loss = np.array([full - tree for (_, tree, _), (_, full, _) in zip(trees, fulls, strict=True)])
    mean, worst, full = PAPER[limb]
    return (
        limb, len(situations), float(counts.mean()), mean, int(counts.max()), worst, fulls[0][2], full,
        100.0 * float(np.mean(loss <= 1e-9)), 100.0 * float(np.mean(loss <= NEARLY)), float(loss.clip(0).mean()),
    )  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--people", type=int, default=2)
    parser.add_argument("--every", type=int, default=20, help="keep every Nth search (default 20)")
    options = parser.parse_args()
    chosen = [take for take in takes(0, options.people, POSTURES) if take.number == 0]
    kept = record(chosen, default_folder(), options.every)
    rows = [
        row(limb, [s for s in kept if s.body.is_leg == (limb == "leg") and np.isclose(s.region, region)])
        for limb, region in (("arm", ARM_REGION), ("leg", LEG_REGION))
    ]
    columns = (
        "limb", "searches", "mean", "paper", "worst", "paper", "full", "paper", "same score %", f"within {NEARLY} %",
        "mean loss",
    )  # fmt: skip
    print(table("Matchings per search; the tri-tree's score against full search's", columns, rows))


if __name__ == "__main__":
    main()
