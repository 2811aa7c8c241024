"""Runs of many cases in several processes, each cached for the current code."""

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

from benchmarks.hybrid.both_ways import run_both_ways
from benchmarks.hybrid.priors import Priors
from benchmarks.hybrid.runs import Case, Film, Run, run
from benchmarks.hybrid.silhouettes import ROOT, Clip, load_clip
from benchmarks.simulated_clip import cycle_clip
from zenocap.services.tracker.prior.file import read_prior

TRACKER_CODE = ("services/tracker", "common/body", "common/camera", "common/rig/tracker.py")
CACHE_VERSION = 3  # version of cached runs: increased when the definition of a figure changes


@dataclass(frozen=True)
class Places:
    """clips, motions: input folders.  out: output folder."""

    clips: Path
    motions: Path
    out: Path


Task = tuple[Places, Case, Path]


@dataclass(frozen=True)
class Bench:
    """jobs: number of processes.  seeds: of every figure.

    names: shared clips of `accuracy` and `angles`, none for all.  priors_used: kinds of prior there, of `accuracy.PRIORS`.
    both_ways: whether they are also tracked both ways.
    """

    places: Places
    jobs: int
    seeds: int
    names: tuple[str, ...] = ()
    priors_used: tuple[str, ...] = ("shipped",)
    both_ways: bool = False

    @property
    def priors(self) -> Priors:
        return Priors(self.places.clips, self.places.motions, self.places.out / "priors")

    def clip(self, name: str) -> Clip:
        """A shared clip."""
        return clip_of(self.places, name)

    def film(self, name: str) -> Film:
        """A shared clip, or one of `cycle_clip`."""
        return film_of(self.places, name)

    def runs(self, cases: Sequence[Case], seeds: int | None = None) -> dict[Case, list[Run]]:
        """Runs of every case (its own seed is ignored) for seeds 0, 1, 2 ..., in the cases' order."""
        each = {case: [_seeded(case, seed) for seed in range(seeds or self.seeds)] for case in cases}
        every = list(dict.fromkeys(case for some in each.values() for case in some))
        for case in every:
            if case.prior:
                self.priors.path(case.prior, case.anatomy)  # trained once, before several processes
        missing = [case for case in every if not self._cache_path(case).is_file()]
        for done, case in enumerate(self._computed([(self.places, case, self._cache_path(case)) for case in missing]), 1):
            print(f"  {time.strftime('%H:%M:%S')} {done:4d} of {len(missing)}: {_title(case)}", flush=True)
        return {case: [_read(self._cache_path(one)) for one in some] for case, some in each.items()}

    def _computed(self, tasks: Sequence[Task]) -> Iterator[Case]:
        """Cases in order of completion."""
        if self.jobs <= 1 or len(tasks) <= 1:
            _use_one_core()
            yield from map(_compute, tasks)
            return
        with get_context("spawn").Pool(self.jobs, _use_one_core) as pool:
            films = dict.fromkeys((self.places, case.clip, case.size, case.t_pose) for _, case, _ in tasks)
            pool.starmap(_prepare_film, films, chunksize=1)
            yield from pool.imap_unordered(_compute, tasks)

    def _cache_path(self, case: Case) -> Path:
        digest = hashlib.sha256(_code().encode())
        digest.update(f"{CACHE_VERSION} {case!r}".encode())
        if case.prior:
            digest.update(self.priors.path(case.prior, case.anatomy).read_bytes())
        return self.places.out / "runs" / f"{case.clip}-{digest.hexdigest()[:20]}.json"


@lru_cache(maxsize=8)
def clip_of(places: Places, name: str, size: tuple[int, int] | None = None, t_pose: bool = True) -> Clip:
    return load_clip(places.clips / name, places.out / "silhouettes", size, t_pose=t_pose)


@lru_cache(maxsize=8)
def film_of(places: Places, name: str, size: tuple[int, int] | None = None, t_pose: bool = True) -> Film:
    return clip_of(places, name, size, t_pose) if (places.clips / name).is_dir() else cycle_clip(name)


def _use_one_core() -> None:
    """Restrict a process to one core."""
    cv2.setNumThreads(1)
    numba.set_num_threads(1)


def _prepare_film(places: Places, clip: str, size: tuple[int, int] | None, t_pose: bool) -> None:
    """Compute the silhouettes of a clip in one process before several read them."""
    film_of(places, clip, size, t_pose)
    film_of.cache_clear()
    clip_of.cache_clear()


def _compute(task: Task) -> Case:
    places, case, path = task
    priors = Priors(places.clips, places.motions, places.out / "priors")
    prior = read_prior(priors.path(case.prior, case.anatomy), case.anatomy) if case.prior else None
    film = film_of(places, case.clip, case.size, case.t_pose)
    result = run_both_ways(film, case, prior) if case.both_ways else run(film, case, prior)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    part.write_text(json.dumps({"case": repr(case), "run": result.plain()}))
    part.replace(path)
    return case


def _read(path: Path) -> Run:
    plain = json.loads(path.read_text())["run"]
    rows = {name: tuple(map(tuple, plain[name])) for name in ("centres_mm", "angles")}
    return Run(**{**plain, "errors": tuple(plain["errors"]), **rows})


def _seeded(case: Case, seed: int) -> Case:
    return replace(case, seed=seed)


def _title(case: Case) -> str:
    default = Case(case.clip)
    changes = [
        f"{name}={value}" for name, value in vars(case).items() if value != getattr(default, name) and name != "clip"
    ]
    return f"{case.clip} {' '.join(changes)}"


@lru_cache(maxsize=1)
def _code() -> str:
    """Digest of the code that the figures depend on."""
    digest = hashlib.sha256()
    for place in TRACKER_CODE:
        path = ROOT / place
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            digest.update(file.read_bytes())
    return digest.hexdigest()[:16]
