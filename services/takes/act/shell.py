"""`zenocap posture act`: the takes of a cast, several at a time, and the manifest that says what is in them."""

import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from multiprocessing import get_context
from pathlib import Path

import cv2
import numba

from common.runtime.rig import Rig
from services.takes.act.cast import Act
from services.takes.act.stage import Method, act, stage

MANIFEST = "manifest.csv"
COLUMNS = ("source", "start", "end", "posture", "person", "repetition")

Report = Callable[[int, int, str], None]


@dataclass(frozen=True)
class Filmed:
    """What became of one act.  poses: in its take.  problems: what was lost on the way, in words."""

    act: Act
    poses: int
    problems: tuple[str, ...]


def perform(folder: Path, method: Method, acts: Sequence[Act], jobs: int, report: Report) -> list[Filmed]:
    """Write the takes that are not there yet, and the manifest of all.  jobs: processes.

    report: takes done, takes in all, the one just done.  Returns what became of the takes written now.  Raises OSError,
    RigError and RecordingError.
    """
    folder.mkdir(parents=True, exist_ok=True)
    missing = [one for one in acts if not take_of(folder, method, one).is_file()]
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
    write_manifest(folder, method, acts)
    return found


def take_of(folder: Path, method: Method, act: Act) -> Path:
    return folder / f"{method}-{act.name}.mcap"


def write_manifest(folder: Path, method: Method, acts: Sequence[Act]) -> Path:
    """One row a take; start and end of the posture in seconds from the start of its take, as the script has them."""
    path = folder / MANIFEST
    with path.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(COLUMNS)
        for one in acts:
            script = one.script()
            times = (f"{script.motion_from_s:.3f}", f"{script.duration_s:.3f}")
            rows.writerow([take_of(folder, method, one).name, *times, one.posture, one.person, one.repetition])
    return path


def _perform(task: tuple[Path, Method, Act]) -> Filmed:
    folder, method, one = task
    path = take_of(folder, method, one)
    part = path.with_suffix(".part")  # renamed when whole: what is there, is done
    tracked = act(_stage(method), method, one.script(), one.room, part)
    part.replace(path)
    return Filmed(one, tracked.poses, tracked.problems)


@lru_cache
def _stage(method: Method) -> Rig:
    return stage(method)


def _alone() -> None:
    """One core for one process."""
    cv2.setNumThreads(1)
    numba.set_num_threads(1)
