"""Advice of a viewer about its camera: hits and false alarms of every kind of advice, by image size.

A viewer reports once a second; seconds before SETTLED_S after the fault has begun are left out.  Whether a fault is present
is known from the film (light, lens, floor), or from the true silhouette over the last seconds: contrast, cut off and small
by the same measures on it, holes by the share of it that is missing: above LOST present, below WHOLE absent.  Seconds in
which it may be reported (`FaultFilm.allowed`) count neither as a hit nor as a false alarm.
"""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.cases.rooms.faults import FILMS, Codes, FaultFilm
from benchmarks.cases.rooms.film import RoomFrame, RoomScene, Situation, shots
from benchmarks.harness.case import Case, Figures, Kind, Quantity, case
from benchmarks.people.films import size_of
from tests.support.stored import stored
from zenocap.common.messages import AdviceCode, CameraAdvice
from zenocap.common.rig.sources import parse_background
from zenocap.services.viewer.advice.watch import AdviceWatch, watched
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.parameters import ADVICE_WINDOW_S
from zenocap.services.viewer.segmentation import learn, segment
from zenocap.services.viewer.states import LearningBackground, ViewerSetup

FIRST_SEED = 200  # nothing was chosen on these
FILM_S = 18.0  # length of the films
TRUTH_EVERY = 5  # frames between two true silhouettes
CALM = "no fault"  # films without a fault by their nature
SETTLED_S = 4.0  # after a fault has begun, from which it has to be reported
LOST, WHOLE = 0.10, 0.06  # of the true silhouette: missing in the silhouette
LEAST_PERSON = 30  # px, of a true silhouette
A = AdviceCode
BY_TRUTH = (A.CONTRAST, A.CUT_OFF, A.SMALL)  # measured on the true silhouette
UNSTEADY = {A.LIGHT_DRIFT, A.WHITE_BALANCE}  # with these, nothing is stated about the person
OF_PERSON = {*BY_TRUTH, A.HOLES, A.GLOSSY_FLOOR, A.MOTION_BLUR}


@dataclass(frozen=True)
class Second:
    """One report.  given: the advice.  present: faults that are there.  unknown: faults that may be there or not."""

    film: str
    given: Codes
    present: Codes
    unknown: Codes


def seconds(film: FaultFilm, scene: RoomScene, frames: Sequence[RoomFrame]) -> Iterator[Second]:
    """Reports of a viewer of a film, from the first one that counts."""
    setup = ViewerSetup("cam01", film.situation.camera(scene), parse_background("first:60", Path()))
    state, place = LearningBackground(), None
    truly, true_codes, lost = AdviceWatch(), frozenset[AdviceCode](), list[tuple[float, float]]()
    for number, shot in enumerate(frames):
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
                yield _second(film, given, true_codes, float(np.median(missing)) if missing else 0.0)


def _second(film: FaultFilm, given: Codes, true_codes: Codes, missing: float) -> Second:
    present = set(film.wanted) | {code for code in BY_TRUTH if code in true_codes}
    unknown = set(film.allowed) - present
    if film.situation.other is not None:
        unknown.add(A.PEOPLE)
    if missing > LOST:
        present.add(A.HOLES)
    elif missing > WHOLE:
        unknown.add(A.HOLES)
    if UNSTEADY & (present | unknown):
        unknown |= OF_PERSON
    return Second(film.situation.name, given, frozenset(present - unknown), frozenset(unknown))


def run(one: Case) -> Figures:
    """Reports of one kind of advice, the film, in all films of a seed, or of any advice in films without a fault.

    Options: size; only, films with one of these in their names, separated by commas.
    """
    size, only = one.option("size", "160x120"), one.option("only", "")
    seconds = stored(lambda: _measured(one.seed, size, only), one.seed, size, only, sources=(__name__,))
    if one.film == CALM:
        calm = [film.situation.name for film in FILMS if not film.wanted]
        every = [each for each in seconds if each.film in calm and not each.present]
        return _share("false alarms", sum(bool(each.given - each.unknown) for each in every), len(every))
    code = AdviceCode(one.film)
    there = [each for each in seconds if code in each.present]
    absent = [each for each in seconds if code not in each.present | each.unknown]
    hits, alarms = (sum(code in each.given for each in some) for some in (there, absent))
    return _share("hits", hits, len(there)) | _share("false alarms", alarms, len(absent))


def _share(name: str, part: int, of: int) -> dict[str, float]:
    return {name: 100.0 * part / of, f"{name}, of": of} if of else {}


def _measured(seed: int, size: str, only: str) -> list[Second]:
    """All seconds of the films of a seed in one image size; films that differ in their tone are rendered once."""
    scene = RoomScene(FIRST_SEED + seed, size_of(size))
    groups = defaultdict[Situation, list[FaultFilm]](list)
    for film in FILMS:
        if any(part in film.situation.name for part in only.split(",")):
            groups[replace(film.situation, name="", tone=None)].append(film)
    found = list[Second]()
    for plain, toned in groups.items():
        rendered = list(shots(scene, plain, TRUTH_EVERY, FILM_S))
        for film in toned:
            tone = film.situation.tone or (lambda scene, time_s, image: image)
            found += seconds(film, scene, [replace(shot, image=tone(scene, shot.time_s, shot.image)) for shot in rendered])
    return found


ADVICE = Kind(
    "advice",
    "Films of 18 s, 15 frames/s, background `first:60`, of every fault and situation; share of the seconds with an "
    "advice, from 4 s after the fault began (hits), and where that fault is absent (false alarms).",
    run,
    (
        Quantity("hits", "%", 1, "low"),
        Quantity("hits, of", "s", 0, joined="sum"),
        Quantity("false alarms", "%"),
        Quantity("false alarms, of", "s", 0, joined="sum"),
    ),
    {
        f"{film}, {size}": case(film, size=size)
        for size in ("160x120", "320x240")
        for film in (*(code.value for code in AdviceCode), CALM)
    },
    case("dark", only="empty room first,dark"),
    seeds=6,
    rows="advice, size",
)
