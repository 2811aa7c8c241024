"""Runs of many cases, in several processes; each is made once for the code as it is, and kept."""

import hashlib
import json
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from multiprocessing import get_context
from pathlib import Path

import cv2
import numba

from services.tracker.prior.file import read_prior
from tests.evaluation.hybrid.priors import Priors
from tests.evaluation.hybrid.runs import ANATOMY, Case, Run, run
from tests.evaluation.hybrid.silhouettes import ROOT, Clip, load_clip

TRACKER_CODE = ("services/tracker", "common/body", "common/camera")
MEANING = 1  # of what is kept of a run: raised when its figures come to mean something else


@dataclass(frozen=True)
class Places:
    """clips, motions: folders that are read.  out: that is written."""

    clips: Path
    motions: Path
    out: Path


Task = tuple[Places, Case, Path]


@dataclass(frozen=True)
class Bench:
    """jobs: processes.  seeds: of every figure."""

    places: Places
    jobs: int
    seeds: int

    @property
    def priors(self) -> Priors:
        return Priors(self.places.clips, self.places.motions, self.places.out / "priors")

    def clip(self, name: str) -> Clip:
        return clip_of(self.places, name)

    def runs(self, cases: Sequence[Case], seeds: int | None = None) -> dict[Case, list[Run]]:
        """The runs of every case (whose own seed is ignored) for seeds 0, 1, 2 ..., in the cases' order."""
        each = {case: [_seeded(case, seed) for seed in range(seeds or self.seeds)] for case in cases}
        every = list(dict.fromkeys(case for some in each.values() for case in some))
        for case in every:
            if case.prior:
                self.priors.path(case.prior)  # learnt here: not by several processes at once
        missing = [case for case in every if not self._kept(case).is_file()]
        for done, case in enumerate(self._made([(self.places, case, self._kept(case)) for case in missing]), 1):
            print(f"  {time.strftime('%H:%M:%S')} {done:4d} of {len(missing)}: {_words(case)}", flush=True)
        return {case: [_read(self._kept(one)) for one in some] for case, some in each.items()}

    def _made(self, tasks: Sequence[Task]) -> Iterator[Case]:
        """Cases as they are done."""
        if self.jobs <= 1 or len(tasks) <= 1:
            _alone()
            yield from map(_make, tasks)
            return
        with get_context("spawn").Pool(self.jobs, _alone) as pool:
            clips = dict.fromkeys(case.clip for _, case, _ in tasks)
            pool.starmap(_prepare, [(self.places, clip) for clip in clips], chunksize=1)
            yield from pool.imap_unordered(_make, tasks)

    def _kept(self, case: Case) -> Path:
        told = hashlib.sha256(_code().encode())
        told.update(f"{MEANING} {case!r}".encode())
        if case.prior:
            told.update(self.priors.path(case.prior).read_bytes())
        return self.places.out / "runs" / f"{case.clip}-{told.hexdigest()[:20]}.json"


@lru_cache(maxsize=8)
def clip_of(places: Places, name: str) -> Clip:
    return load_clip(places.clips / name, places.out / "silhouettes")


def _alone() -> None:
    """One core for one process."""
    cv2.setNumThreads(1)
    numba.set_num_threads(1)


def _prepare(places: Places, clip: str) -> None:
    """Silhouettes are made by one process each, before several need the same ones."""
    clip_of(places, clip)
    clip_of.cache_clear()


def _make(task: Task) -> Case:
    places, case, path = task
    prior = (
        read_prior(Priors(places.clips, places.motions, places.out / "priors").path(case.prior), ANATOMY)
        if case.prior
        else None
    )
    made = run(clip_of(places, case.clip), case, prior)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    part.write_text(json.dumps({"case": repr(case), "run": made.plain()}))
    part.replace(path)
    return case


def _read(path: Path) -> Run:
    plain = json.loads(path.read_text())["run"]
    return Run(**{**plain, "errors": tuple(plain["errors"])})


def _seeded(case: Case, seed: int) -> Case:
    return replace(case, seed=seed)


def _words(case: Case) -> str:
    default = Case(case.clip)
    told = [f"{name}={value}" for name, value in vars(case).items() if value != getattr(default, name) and name != "clip"]
    return f"{case.clip} {' '.join(told)}"


@lru_cache(maxsize=1)
def _code() -> str:
    """What decides the figures."""
    told = hashlib.sha256()
    for place in TRACKER_CODE:
        path = ROOT / place
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            told.update(file.read_bytes())
    return told.hexdigest()[:16]
