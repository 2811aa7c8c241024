"""Two-view tracking of twelve simulated people, fifteen postures, two takes each, at 160 x 120 and 15 frames/s.

    python -m benchmarks.postures [--quick] [--people-seed N] [--posture NAME ...] [--jobs N] [--no-cache]

Scored from the start of the posture on, against the true joints.  lost: share of frames without a universal BAP
or with joints more than 250 mm off in the mean.  joints lost: share of lost joints as counted by score_trc.py.
"""

import argparse
from functools import partial
from multiprocessing import Pool
from pathlib import Path

import cv2
import numpy as np

from benchmarks.errors import LIMB_SEGMENTS, SUMMARY, FrameError, frame_error, summary
from benchmarks.loop import track_film
from benchmarks.table import table
from benchmarks.takes import PEOPLE, Take, default_folder, film, takes
from zenocap.simulation.motion.posture_style import POSTURES

QUICK_PEOPLE = 2


def errors_of(take: Take, folder: Path | None) -> list[FrameError]:
    """The errors of one take's scored frames."""
    cv2.setNumThreads(1)
    rendered = film(take, folder)
    track = track_film(rendered, take.fps)
    errors = []
    for k in range(rendered.motion_from, len(rendered.truths)):
        true = rendered.truths[k]
        assert true is not None, "the person is in the scene from the initial posture on"
        errors.append(frame_error(track.estimate(k), true))
    return errors


def run(chosen: list[Take], folder: Path | None, jobs: int) -> dict[Take, list[FrameError]]:
    with Pool(jobs) as pool:
        return dict(zip(chosen, pool.imap(partial(errors_of, folder=folder), chosen), strict=True))


def report(results: dict[Take, list[FrameError]]) -> str:
    rows = []
    for posture in dict.fromkeys(take.posture for take in results):
        rows.append((posture, *summary([e for take, found in results.items() if take.posture == posture for e in found])))
    every = [error for found in results.values() for error in found]
    rows.append(("all", *summary(every)))
    segments = np.stack([error.segments for error in every if np.isfinite(error.segments).all()])
    parts = [(name, float(segments[:, k].mean()), float(np.median(segments[:, k]))) for k, name in enumerate(LIMB_SEGMENTS)]
    people = [
        (person_seed, *summary([e for take, found in results.items() if take.person == person_seed for e in found]))
        for person_seed in dict.fromkeys(take.person for take in results)
    ]
    return "\n".join(
        [
            table("Postures", ("posture", *SUMMARY), rows),
            table("People", ("person", *SUMMARY), people),
            table("Limb segments, degrees", ("segment", "mean", "median"), parts),
        ]
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help=f"{QUICK_PEOPLE} people instead of {PEOPLE}")
    parser.add_argument("--people-seed", type=int, default=0, help="other people, other takes (default 0)")
    parser.add_argument("--posture", nargs="+", choices=POSTURES, default=POSTURES, metavar="NAME")
    parser.add_argument("--jobs", type=int, default=2, help="processes (default 2)")
    parser.add_argument("--no-cache", action="store_true", help="do not keep the rendered frames (about 10 MB a take)")
    options = parser.parse_args()
    chosen = takes(options.people_seed, QUICK_PEOPLE if options.quick else PEOPLE, tuple(options.posture))
    print(report(run(chosen, None if options.no_cache else default_folder(), options.jobs)))


if __name__ == "__main__":
    main()
