"""`make priors`: train the shipped motion priors on simulated people.  Equal code gives equal bytes.

python -m zenocap.tools.teach.dataset.build_priors [NAME...] [--to FOLDER]
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS, Anatomy
from zenocap.common.body.coordinates import coordinates_of
from zenocap.common.rig.tracker import SUFFIX
from zenocap.data import PRIORS
from zenocap.services.tracker.prior.file import write_prior
from zenocap.services.tracker.prior.model import Prior
from zenocap.services.tracker.prior.motions import actor_motion
from zenocap.services.tracker.prior.sequences import TrainingMotion
from zenocap.services.tracker.prior.training import TrainingPlan, train

KINDS = ("walking", "running", "boxing", "general")
PAPER = "-paper"  # suffix of the priors for the preset paper: ten parts, 20 regions
NAMES = (*KINDS, *(f"{kind}{PAPER}" for kind in KINDS))
PEOPLE = (1, 2, 3, 4)  # seeds of person and movement
HELD_PERSON = 5
RATE = 60.0
PLAN = TrainingPlan(rate=RATE)
PAPER_PLAN = TrainingPlan(rate=RATE, regions=20, candidates=(20,))  # [Hybrid VI, Fig. 4]


def shipped_prior(name: str, people: Sequence[int] = PEOPLE, plan: TrainingPlan | None = None) -> Prior:
    """Train the prior of one of NAMES on these people; the number of regions is chosen on HELD_PERSON, or the paper's."""
    kind, paper = name.removesuffix(PAPER), name.endswith(PAPER)
    anatomy = TEN_PARTS if paper else FOURTEEN_PARTS
    motions = [recording(kind, person, anatomy) for person in people]
    held = [recording(kind, HELD_PERSON, anatomy)]
    return train(coordinates_of(anatomy), motions, held, plan or (PAPER_PLAN if paper else PLAN))


def recording(kind: str, person: int, anatomy: Anatomy = FOURTEEN_PARTS) -> TrainingMotion:
    return actor_motion(kind, person, person, anatomy, RATE)


def main() -> None:
    parser = argparse.ArgumentParser(description="Train the shipped priors on simulated people.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(NAMES)}; default: all")
    parser.add_argument("--to", type=Path, default=PRIORS, metavar="FOLDER")
    wanted = parser.parse_args()
    unknown = set(wanted.names) - set(NAMES)
    if unknown:
        parser.error(f"{', '.join(sorted(unknown))}: allowed: {', '.join(NAMES)}")
    for name in wanted.names or NAMES:
        prior = shipped_prior(name)
        path = wanted.to / f"{name}{SUFFIX}"
        write_prior(path, prior)
        print(f"{path}: {prior.regions} regions of {prior.training.frames} frames, {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
