"""Repeatability: equal seeds give equal poses, bit for bit, with one thread and with two."""

import os

import numba
import numpy as np

from benchmarks.hybrid.bench import Bench
from benchmarks.hybrid.priors import KINDS
from benchmarks.hybrid.runs import ANATOMY, Case, TrackedPath, track_clip
from benchmarks.sections import Section, Table
from zenocap.services.tracker.prior.file import read_prior

CLIPS = ("walk2", "kick2", "box7")


def repeat(bench: Bench) -> Section:
    rows = []
    for clip in CLIPS:
        prior = read_prior(bench.priors.path(KINDS[clip]), ANATOMY)
        paths = []
        for threads, seed in ((1, 3), (1, 3), (2, 3), (1, 4)):
            numba.set_num_threads(min(threads, os.cpu_count() or 1))
            paths.append(track_clip(bench.clip(clip), Case(clip, seed=seed), prior))
        equal = [_equal_paths(paths[0], other) for other in paths[1:]]
        rows.append((clip, len(paths[0].poses), *("yes" if one else "no" for one in equal)))
    numba.set_num_threads(1)
    return Section(
        "repeat",
        "Repeatability",
        ("Every pose compared bit for bit; another seed must differ.",),
        (
            Table(
                "Equal to the first run", ("clip", "poses", "second run", "with two threads", "another seed"), tuple(rows)
            ),
        ),
    )


def _equal_paths(first: TrackedPath, other: TrackedPath) -> bool:
    return first.poses.keys() == other.poses.keys() and all(
        np.array_equal(pose.angles, other.poses[frame][1].angles)
        and np.array_equal(pose.position, other.poses[frame][1].position)
        for frame, (_, pose) in first.poses.items()
    )
