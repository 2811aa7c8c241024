"""`zenocap posture act`: the takes of a cast, several at a time, and the manifest that says what is in them."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from multiprocessing import get_context
from pathlib import Path

import cv2
import numba

from common.runtime.rig import Rig
from services.recognizer.manifest import Row, write_manifest
from services.takes.act.cast import Act
from services.takes.act.stage import Method, act, stage

MANIFEST = "manifest.csv"

Report = Callable[[int, int, str], None]


@dataclass(frozen=True)
class Filmed:
    """What became of one act.  poses: in its take.  problems: what was lost on the way, in words."""

    act: Act
    poses: int
    problems: tuple[str, ...]


def perform(folder: Path, method: Method, acts: Sequence[Act], jobs: int, report: Report) -> list[Filmed]:
    """Write the takes that are not there yet, and the manifest of all.  jobs: processes.

    report: takes done, takes in all, the one just done.  Returns what became of the takes written now; one without
    any pose is not in the manifest.  Raises OSError, RigError and RecordingError.
    """
    folder.mkdir(parents=True, exist_ok=True)
    takes = {one: take_of(folder, method, one) for one in acts}
    missing = [one for one, take in takes.items() if not take.is_file() and not _without(take).is_file()]
    done = len(acts) - len(missing)
    report(done, len(acts), "")
    found = []
    tasks = [(folder, method, one) for one in missing]
    if jobs == 1 or len(tasks) <= 1:
        for task in tasks:
            found.append(_perform(task))
            report(done + len(found), len(acts), task[2].name)
    else:
        with get_context("spawn").Pool(min(jobs, len(tasks)), _alone) as pool:
            for one in pool.imap_unordered(_perform, tasks):
                found.append(one)
                report(done + len(found), len(acts), one.act.name)
    listed(folder, method, acts)
    return found


def take_of(folder: Path, method: Method, act: Act) -> Path:
    return folder / f"{method}-{act.name}.mcap"


def listed(folder: Path, method: Method, acts: Sequence[Act]) -> Path:
    """The manifest of the takes that have poses: start and end of the posture as the script has them."""
    rows = []
    for one in acts:
        take, script = take_of(folder, method, one), one.script()
        if take.is_file():
            person, number = str(one.person), str(one.repetition)
            rows.append(Row(0, take, script.motion_from_s, script.duration_s, one.posture, person, number))
    write_manifest(folder / MANIFEST, rows)
    return folder / MANIFEST


def _perform(task: tuple[Path, Method, Act]) -> Filmed:
    folder, method, one = task
    take = take_of(folder, method, one)
    part = take.with_suffix(f".{os.getpid()}.part")
    tracked = act(_stage(method), method, one.script(), one.room, part)
    part.replace(take if tracked.poses else _without(take))  # renamed when whole: what is there, is done
    return Filmed(one, tracked.poses, tracked.problems)


def _without(take: Path) -> Path:
    """What a take is called in which nobody was found."""
    return take.with_suffix(".nobody.mcap")


@lru_cache
def _stage(method: Method) -> Rig:
    return stage(method)


def _alone() -> None:
    """One core for one process."""
    cv2.setNumThreads(1)
    numba.set_num_threads(1)
