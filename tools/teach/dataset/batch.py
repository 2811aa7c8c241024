"""Takes of a posture dataset: list, generation in several processes, and manifest."""

import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from multiprocessing import get_context
from pathlib import Path

import cv2
import numba

from zenocap.common.rig.rig import Rig
from zenocap.services.recognizer.training.manifest import ManifestRow, write_manifest
from zenocap.simulation.body.person import person
from zenocap.simulation.motion.posture_style import POSTURES
from zenocap.simulation.motion.timeline import MotionTimeline, posture_timeline
from zenocap.tools.teach.dataset.generate import Method, dataset_rig, generate_take

MANIFEST = "manifest.csv"
PEOPLE = 12  # as in [Two-view 5]
REPETITIONS = 2

Report = Callable[[int, int, str], None]
"""Progress: takes done, their number, and the name of the latest."""


@dataclass(frozen=True)
class PostureTake:
    """One repetition of a posture by a simulated person.  person: its seed.  repetition: from 0."""

    person: int
    posture: str
    repetition: int

    @property
    def name(self) -> str:
        return f"{self.person}-{self.posture}-{self.repetition}"

    @property
    def room(self) -> int:
        """Seed of room, light and noise, different for every take."""
        return 1000 * self.person + 10 * POSTURES.index(self.posture) + self.repetition

    def timeline(self) -> MotionTimeline:
        """Empty scene, T-pose, arms down, then the posture from `motion_from_s` to `duration_s`."""
        return posture_timeline(person(self.person), self.posture, self.repetition)


@dataclass(frozen=True)
class GeneratedTake:
    """Result of a take.  poses: number in the take.  problems: of tracking or recording, as text."""

    take: PostureTake
    poses: int
    problems: tuple[str, ...]


def people(people_seed: int, count: int = PEOPLE) -> range:
    """Seeds of `count` people; up to twelve people of different `people_seed` are all different."""
    return range(PEOPLE * people_seed, PEOPLE * people_seed + count)


def posture_takes(
    people: Iterable[int], postures: Iterable[str] = POSTURES, repetitions: int = REPETITIONS
) -> list[PostureTake]:
    """Every repetition of every posture by every person.  Raises ValueError for a posture not in POSTURES."""
    wanted = tuple(dict.fromkeys(postures))
    for posture in wanted:
        if posture not in POSTURES:
            raise ValueError(f"posture {posture!r}: allowed: {', '.join(POSTURES)}")
    return [PostureTake(seed, posture, k) for seed in people for posture in wanted for k in range(repetitions)]


def generate_takes(
    folder: Path, method: Method, takes: Sequence[PostureTake], jobs: int, report: Report,
    size: tuple[int, int] | None = None,
) -> list[GeneratedTake]:  # fmt: skip
    """Write the takes that do not exist yet, and the manifest of all; return the results of the new ones.

    jobs: number of processes.  size: of the images (width, height) px, default by method.  A take without poses is not in
    the manifest.  Raises OSError and UserError.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = {one: take_path(folder, method, one) for one in takes}
    missing = [one for one, path in paths.items() if not path.is_file() and not _path_without_poses(path).is_file()]
    done = len(takes) - len(missing)
    report(done, len(takes), "")
    found = []
    tasks = [(folder, method, size, one) for one in missing]
    if jobs == 1 or len(tasks) <= 1:
        for task in tasks:
            found.append(_generate(task))
            report(done + len(found), len(takes), task[3].name)
    else:
        with get_context("spawn").Pool(min(jobs, len(tasks)), _use_one_thread) as pool:
            for one in pool.imap_unordered(_generate, tasks):
                found.append(one)
                report(done + len(found), len(takes), one.take.name)
    write_takes_manifest(folder, method, takes)
    return found


def take_path(folder: Path, method: Method, take: PostureTake) -> Path:
    return folder / f"{method}-{take.name}.mcap"


def write_takes_manifest(folder: Path, method: Method, takes: Sequence[PostureTake]) -> None:
    """Write the manifest of the takes with poses; start and end of the posture are those of its time line."""
    rows = []
    for one in takes:
        path, timeline = take_path(folder, method, one), one.timeline()
        if path.is_file():
            name, number = str(one.person), str(one.repetition)
            rows.append(ManifestRow(0, path, timeline.motion_from_s, timeline.duration_s, one.posture, name, number))
    write_manifest(folder / MANIFEST, rows)


def _generate(task: tuple[Path, Method, tuple[int, int] | None, PostureTake]) -> GeneratedTake:
    folder, method, size, one = task
    path = take_path(folder, method, one)
    unfinished = path.with_suffix(f".{os.getpid()}.part")
    tracked = generate_take(_rig(method, size), method, one.timeline(), one.room, unfinished)
    unfinished.replace(path if tracked.poses else _path_without_poses(path))  # only complete takes have their final name
    return GeneratedTake(one, tracked.poses, tracked.problems)


def _path_without_poses(path: Path) -> Path:
    return path.with_suffix(".without-poses.mcap")


@lru_cache
def _rig(method: Method, size: tuple[int, int] | None) -> Rig:
    return dataset_rig(method, size)


def _use_one_thread() -> None:
    cv2.setNumThreads(1)
    numba.set_num_threads(1)
