"""Advice of a viewer about its camera: hits and false alarms of every kind of advice, by image size.

    python -m benchmarks.rooms.advice [--seeds 6] [--first-seed 200] [--sizes 160x120,320x240] [--only NAME,...]

A viewer reports once a second; seconds before SETTLED_S after the fault has begun are left out.  Whether a fault is present
is known from the film (light, lens, floor), or from the true silhouette over the last seconds: contrast, cut off and small
by the same measures on it, holes by the share of it that is missing: above LOST present, below WHOLE absent.
fault: share of the seconds with that fault in which it is reported, and their number.  no such fault: share of the seconds
without it, where it is reported all the same.  Seconds in which it may be reported (`Film.allowed`) are in neither.
The second table of a size has films without a fault by their nature: seconds without any, with any advice, and which.
"""

import argparse
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from multiprocessing import Pool
from pathlib import Path

import cv2
import numpy as np

from benchmarks.rooms.faults import FILMS, TRUTH_EVERY, Film
from benchmarks.rooms.film import Scene, Shot
from benchmarks.table import table
from zenocap.common.messages import AdviceCode, CameraAdvice
from zenocap.common.rig.sources import parse_background
from zenocap.services.viewer.advice.watch import Watch, watched
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.parameters import ADVICE_WINDOW_S
from zenocap.services.viewer.segmentation import learn, segment
from zenocap.services.viewer.states import LearningBackground, viewer_setup

SETTLED_S = 4.0  # after a fault has begun, from which it has to be reported
LOST, WHOLE = 0.10, 0.06  # of the true silhouette: missing in the silhouette
LEAST_PERSON = 30  # px, of a true silhouette
A = AdviceCode
BY_TRUTH = (A.CONTRAST, A.CUT_OFF, A.SMALL)  # measured on the true silhouette
UNSTEADY = {A.LIGHT_DRIFT, A.WHITE_BALANCE}  # with these, nothing is stated about the person
OF_PERSON = {*BY_TRUTH, A.HOLES, A.GLOSSY_FLOOR, A.MOTION_BLUR}
Codes = frozenset[AdviceCode]


@dataclass(frozen=True)
class Second:
    """One report.  given: the advice.  present: faults that are there.  unknown: faults that may be there or not."""

    film: str
    size: tuple[int, int]
    given: Codes
    present: Codes
    unknown: Codes


def seconds(film: Film, scene: Scene, shots: Sequence[Shot], background: str) -> Iterator[Second]:
    """Reports of a viewer of a film, from the first one that counts."""
    setup = viewer_setup("cam01", film.camera(scene), parse_background(background, Path()), True)
    state, place = LearningBackground(), None
    truly, true_codes, lost = Watch(), frozenset[AdviceCode](), list[tuple[float, float]]()
    for number, shot in enumerate(shots):
        if place is None:
            state, place = learn(setup, state, shot.image)
            continue
        place, mask, messages = segment(setup, place, Frame(number, round(shot.time_s * 1e9), shot.image))
        if number % TRUTH_EVERY == 0:
            some = np.count_nonzero(shot.truth) > LEAST_PERSON
            assert place.background is not None
            truly, faults = watched(truly, shot.image, shot.time_s, shot.truth if some else None, place.background.room)
            if faults is not None:
                true_codes = frozenset(one.code for one in faults)
            if some:
                found = 0 if mask is None else int(np.count_nonzero(shot.truth & mask))
                lost.append((shot.time_s, 1.0 - found / int(np.count_nonzero(shot.truth))))
        for message in messages:
            if isinstance(message, CameraAdvice) and shot.time_s >= film.since_s + SETTLED_S:
                given = frozenset(one.code for one in message.faults)
                missing = [share for time_s, share in lost if shot.time_s - time_s <= ADVICE_WINDOW_S]
                yield _second(film, scene, given, true_codes, float(np.median(missing)) if missing else 0.0)


def _second(film: Film, scene: Scene, given: Codes, true_codes: Codes, missing: float) -> Second:
    present = set(film.wanted) | {code for code in BY_TRUTH if code in true_codes}
    unknown = set(film.allowed) - present
    if missing > LOST:
        present.add(A.HOLES)
    elif missing > WHOLE:
        unknown.add(A.HOLES)
    if UNSTEADY & (present | unknown):
        unknown |= OF_PERSON
    return Second(film.name, scene.size, given, frozenset(present - unknown), frozenset(unknown))


def films_with(names: str) -> list[Film]:
    """Films whose name contains one of the names, which are separated by commas."""
    return [one for one in FILMS if any(part in one.name for part in names.split(","))]


def measured(job: tuple[int, tuple[int, int]], only: str, background: str) -> list[Second]:
    """All seconds of the films of a seed in one image size; films that differ in their tone are rendered once."""
    cv2.setNumThreads(1)
    seed, size = job
    scene = Scene(seed, size)
    groups = defaultdict[Film, list[Film]](list)
    for film in films_with(only):
        groups[film.without_tone()].append(film)
    found = list[Second]()
    for plain, toned in groups.items():
        shots = list(plain.shots(scene))
        for film in toned:
            found += seconds(film, scene, [film.toned(scene, shot) for shot in shots], background)
    return found


def share(part: int, of: int) -> str:
    """As `83 % of 120`."""
    return f"{part / of:.0%} of {of}".replace("%", " %") if of else ""


def kinds(found: Sequence[Second], size: tuple[int, int]) -> Iterator[tuple[str, str, str]]:
    """Of each kind of advice in a size: reported where the fault is, and where it is not."""
    every = [one for one in found if one.size == size]
    for code in AdviceCode:
        there = [one for one in every if code in one.present]
        absent = [one for one in every if code not in one.present | one.unknown]
        hits, alarms = (sum(code in one.given for one in some) for some in (there, absent))
        rate = f"{100.0 * alarms / len(absent):.1f} % of {len(absent)}" if absent else ""
        yield code.value, share(hits, len(there)), rate


def calm(found: Sequence[Second], size: tuple[int, int], films: Sequence[Film]) -> Iterator[tuple[str, str, str]]:
    """Of each film without a fault in a size: seconds without one that have any advice, and which."""
    for film in films:
        every = [one for one in found if one.size == size and one.film == film.name and not one.present]
        wrong = [one.given - one.unknown for one in every]
        which = Counter(code.value for codes in wrong for code in codes)
        alarms = sum(bool(codes) for codes in wrong)
        rate = f"{100.0 * alarms / len(every):.1f} % of {len(every)}" if every else ""
        yield film.name, rate, ", ".join(f"{code} {count}" for code, count in which.most_common())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--first-seed", type=int, default=200)
    parser.add_argument("--sizes", default="160x120,320x240,640x480")
    parser.add_argument("--background", default="first:60")
    parser.add_argument("--only", default="", help="films whose name contains one of these")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--values", action="store_true", help="also print the advice of every film of every seed")
    options = parser.parse_args()
    sizes = [(int(width), int(height)) for width, height in (text.split("x") for text in options.sizes.split(","))]
    films = films_with(options.only)
    jobs = [(seed, size) for size in sizes for seed in range(options.first_seed, options.first_seed + options.seeds)]
    found = list[Second]()
    with Pool(options.jobs) as pool:
        work = partial(measured, only=options.only, background=options.background)
        for (seed, size), every in zip(jobs, pool.imap(work, jobs), strict=True):
            found += every
            if options.values:
                _print_values(seed, size, every)
    for size in sizes:
        print(table(f"{size[0]}x{size[1]}", ("advice", "fault", "no such fault"), list(kinds(found, size))))
        rows = list(calm(found, size, [film for film in films if not film.wanted]))
        print(table("", ("film without a fault", "any advice", "which"), rows))


def _print_values(seed: int, size: tuple[int, int], every: Sequence[Second]) -> None:
    by_film = defaultdict[str, list[Second]](list)
    for one in every:
        by_film[one.film].append(one)
    for name, some in by_film.items():
        counts = [Counter(code.value for one in some for code in codes(one)) for codes in (_given, _present)]
        print(seed, size, name, len(some), "given", dict(counts[0]), "present", dict(counts[1]), flush=True)


def _given(one: Second) -> Codes:
    return one.given


def _present(one: Second) -> Codes:
    return one.present


if __name__ == "__main__":
    main()
