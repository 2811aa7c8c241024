"""Advice of a viewer about its camera: hits and false alarms, by situation and fault.

    python -m benchmarks.rooms.advice [--seeds 12] [--first-seed 0] [--background first:60] [--only NAME,...]

found: films in which the right advice was given for a tenth of the time or more.  false: films with another advice of that
kind, and which.  time: processor time of the advice, ms per frame.
"""

import argparse
from collections import Counter, defaultdict
from contextlib import ExitStack
from functools import partial
from multiprocessing import Pool
from pathlib import Path
from time import process_time
from unittest.mock import patch

import cv2
import numpy as np

from benchmarks.rooms.faults import FILMS
from benchmarks.rooms.situations import EMPTY_S, Scene
from benchmarks.table import table
from zenocap.common.camera_advice import TakeAdvice
from zenocap.common.messages import AdviceCode, CameraAdvice, CameraFault
from zenocap.common.rig.sources import parse_background
from zenocap.services.viewer import segmentation
from zenocap.services.viewer.advice import watch as watch_module
from zenocap.services.viewer.advice.faults import Measured, faults_of, values_of
from zenocap.services.viewer.advice.watch import Watch, watched
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.segmentation import learn, segment
from zenocap.services.viewer.states import LearningBackground, viewer_setup

OFTEN_CUT = 0.4  # of the images with a person, in which the true silhouette is cut off
LEAST_PERSON = 30  # px, of a true silhouette
COLUMNS = ("situation", "found", "false", "which", "time")
Row = tuple[list[CameraFault], bool, float, dict[str, tuple[float, float, float]]]


def measured(job: tuple[int, str], size: tuple[int, int], background: str) -> Row:
    """Faults over the film, whether the person is truly cut off, time per frame (ms), and the ranges of all measures."""
    cv2.setNumThreads(1)
    seed, name = job
    scene = Scene(seed, size)
    film = next(one for one in FILMS if one.name == name)
    setup = viewer_setup("cam01", film.camera(scene), parse_background(background, Path()), True)
    state, place = LearningBackground(), None
    collected, cut = TakeAdvice(), []
    values: defaultdict[str, list[float]] = defaultdict(list)
    used = {"advice": 0.0}

    def timed(watch: Watch, *rest: object) -> object:
        start = process_time()
        found = watched(watch, *rest)  # type: ignore[arg-type]  # passed on as they came
        used["advice"] += process_time() - start
        return found

    def noted(found: Measured) -> list[CameraFault]:
        for one in values_of(found):
            values[f"{one.code.value} {one.part}".strip()].append(one.value)
        return faults_of(found)

    stack = ExitStack()
    stack.enter_context(patch.object(watch_module, "faults_of", noted))
    stack.enter_context(patch.object(segmentation, "watched", timed))  # a stop-watch around it
    number = 0
    for number, shot in enumerate(film.shots(scene)):
        if np.count_nonzero(shot.truth) > LEAST_PERSON:
            truth = shot.truth
            cut.append(any(np.count_nonzero(edge) >= 3 for edge in (truth[0], truth[-1], truth[:, 0], truth[:, -1])))
        if place is None:
            state, place = learn(setup, state, shot.image)
            continue
        place, _, messages = segment(setup, place, Frame(number, round(shot.time_s * 1e9), shot.image))
        for message in messages:
            if isinstance(message, CameraAdvice) and shot.time_s > EMPTY_S:
                collected.add(message)
    stack.close()
    found = [one.fault for one in collected.faults()]
    return found, bool(np.mean(cut) > OFTEN_CUT), 1e3 * used["advice"] / number, _ranges(values)


def _ranges(values: dict[str, list[float]]) -> dict[str, tuple[float, float, float]]:
    return {name: (min(every), float(np.median(every)), max(every)) for name, every in values.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=12)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--size", default="320x240")
    parser.add_argument("--background", default="first:60")
    parser.add_argument("--only", default="", help="situations whose name contains one of these")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--values", action="store_true", help="also print every fault that was found")
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))
    films = [one for one in FILMS if any(part in one.name for part in options.only.split(","))]
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    jobs = [(seed, film.name) for seed in seeds for film in films]
    work = partial(measured, size=(width, height), background=options.background)
    with Pool(options.jobs) as pool:
        rows = {}
        for job, row in zip(jobs, pool.imap(work, jobs), strict=True):
            rows[job] = row
            if options.values:
                print(*job, [(one.code.value, one.part, one.value) for one in row[0]], row[1], row[3], flush=True)
    cells = []
    for film in films:
        hits, alarms, which, shares = 0, 0, Counter[str](), []
        for seed in seeds:
            faults, cut, share, _ = rows[seed, film.name]
            codes = {fault.code for fault in faults}
            wanted, allowed = film.wanted, film.wanted | film.allowed
            if cut:
                allowed |= {AdviceCode.CUT_OFF}
            hits += bool(codes & wanted)
            alarms += bool(codes - allowed)
            which.update(code.value for code in codes - allowed)
            shares.append(share)
        found = f"{hits}/{len(seeds)}" if film.wanted else ""
        text = ", ".join(f"{code} {count}" for code, count in which.most_common())
        cells.append((film.name, found, f"{alarms}/{len(seeds)}", text, f"{np.median(shares):.2f}"))
    print(table("", COLUMNS, cells))


if __name__ == "__main__":
    main()
