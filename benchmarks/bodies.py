"""Body definition errors: sizes measured by both viewers in the T-pose against the person's true sizes.

    python -m benchmarks.bodies [--people-seed N] [--people N]

Two takes per person.  bias: mean of estimate less truth; error: mean of its absolute value; both in mm.
"""

import argparse
from functools import partial
from multiprocessing import Pool
from pathlib import Path

import cv2
import numpy as np

from benchmarks.loop import track_film
from benchmarks.table import table
from benchmarks.takes import PEOPLE, Take, default_folder, film, takes
from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.definition import Bdp
from zenocap.simulation.body.person import person
from zenocap.simulation.ground_truth import true_bdp

AXES = (("height", 0), ("long radius", 1), ("short radius", 2))
OFFSETS = (
    ("left_shoulder", "breadth", 0),
    ("left_shoulder", "height", 1),
    ("left_hip", "breadth", 0),
    ("neck", "height", 1),
)
POSTURE = "raise-right-arm"  # any: only the T-pose counts


def parameters(bdp: Bdp) -> dict[str, float]:
    """Every size, one side of the body, and the offsets that differ between people, in mm."""
    found = {}
    for part in TEN_PARTS.parts:
        if part.startswith("right_"):
            continue
        circular = part in TEN_PARTS.circular
        for name, axis in AXES[:2] if circular else AXES:
            label = "radius" if circular and axis else name
            found[f"{part.removeprefix('left_')} {label}"] = 1000.0 * float(bdp.sizes[TEN_PARTS.index[part], axis])
    for joint, name, axis in OFFSETS:
        found[f"{joint.removeprefix('left_')} {name}"] = 1000.0 * float(bdp.offsets[TEN_PARTS.index[joint], axis])
    return found


def measured(take: Take, folder: Path | None) -> dict[str, float] | None:
    cv2.setNumThreads(1)
    body = track_film(film(take, folder), take.fps).body
    return None if body is None else parameters(body)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--people-seed", type=int, default=0)
    parser.add_argument("--people", type=int, default=PEOPLE)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    chosen = takes(options.people_seed, options.people, (POSTURE,))
    with Pool(options.jobs) as pool:
        found = pool.map(partial(measured, folder=default_folder()), chosen)
    pairs = [(body, parameters(true_bdp(person(t.person)))) for body, t in zip(found, chosen, strict=True) if body]
    print(f"{len(pairs)} of {len(chosen)} takes have a universal BDP")
    rows = []
    for name in pairs[0][1]:
        truth: Floats = np.array([true[name] for _, true in pairs])
        error = np.array([body[name] for body, _ in pairs]) - truth
        rows.append(
            (name, float(truth.mean()), float(error.mean()), float(np.abs(error).mean()), float(np.abs(error).max()))
        )
    print(table("Body definition", ("parameter", "true mm", "bias mm", "error mm", "largest mm"), rows))


if __name__ == "__main__":
    main()
