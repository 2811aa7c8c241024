"""`make priors`: the priors that come with zenocap, learnt from the synthetic actor.  The same bytes every time.

python -m services.tracker.prior.ship [NAME...] [--to FOLDER]
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from common.body.anatomy import FOURTEEN_PARTS
from common.body.coordinates import coordinates_of
from services.tracker.motions import actor_motion
from services.tracker.prior.file import write_prior
from services.tracker.prior.model import Prior
from services.tracker.prior.shipped import FOLDER, SUFFIX
from services.tracker.prior.training import Plan, Recording, train

KINDS = ("walking", "running", "boxing", "general")
PEOPLE = (1, 2, 3, 4)  # every one with a performance of their own
HELD_PERSON = 5
RATE = 60.0
PLAN = Plan(rate=RATE)


def shipped_prior(kind: str, people: Sequence[int] = PEOPLE, plan: Plan = PLAN) -> Prior:
    """A prior of one of KINDS, of these people; the number of regions is chosen on another."""
    held = [recording(kind, HELD_PERSON)]
    return train(coordinates_of(FOURTEEN_PARTS), [recording(kind, person) for person in people], held, plan)


def recording(kind: str, person: int) -> Recording:
    motion = actor_motion(kind, person, person, FOURTEEN_PARTS, RATE)
    return Recording(motion.name, motion.rate, motion.coordinates)


def main() -> None:
    parser = argparse.ArgumentParser(description="Learn the priors that come with zenocap from the synthetic actor.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(KINDS)}; default: all")
    parser.add_argument("--to", type=Path, default=FOLDER, metavar="FOLDER")
    wanted = parser.parse_args()
    unknown = set(wanted.names) - set(KINDS)
    if unknown:
        parser.error(f"{', '.join(sorted(unknown))}: allowed: {', '.join(KINDS)}")
    for kind in wanted.names or KINDS:
        prior = shipped_prior(kind)
        path = wanted.to / f"{kind}{SUFFIX}"
        write_prior(path, prior)
        print(f"{path}: {prior.regions} regions of {prior.training.frames} frames, {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
