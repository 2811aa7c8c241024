"""The same seed gives the same poses: bit for bit, with one thread and with two."""

import os

import numba
import numpy as np

from services.tracker.prior.file import read_prior
from tests.evaluation.hybrid.bench import Bench
from tests.evaluation.hybrid.priors import KINDS
from tests.evaluation.hybrid.runs import ANATOMY, Case, Followed, followed
from tests.evaluation.sections import Section, Table

CLIPS = ("walk2", "kick2", "box7")


def repeat(bench: Bench) -> Section:
    rows = []
    for clip in CLIPS:
        prior = read_prior(bench.priors.path(KINDS[clip]), ANATOMY)
        paths = []
        for threads, seed in ((1, 3), (1, 3), (2, 3), (1, 4)):
            numba.set_num_threads(min(threads, os.cpu_count() or 1))
            paths.append(followed(bench.clip(clip), Case(clip, seed=seed), prior))
        same = [_same(paths[0], other) for other in paths[1:]]
        rows.append((clip, len(paths[0].poses), *("yes" if one else "no" for one in same)))
    numba.set_num_threads(1)
    return Section(
        "repeat",
        "The same seed, the same poses",
        ("Every pose compared bit for bit; another seed must differ.",),
        (Table("Equal to the first run", ("clip", "poses", "again", "with two threads", "another seed"), tuple(rows)),),
    )


def _same(one: Followed, other: Followed) -> bool:
    return one.poses.keys() == other.poses.keys() and all(
        np.array_equal(pose.angles, other.poses[frame][1].angles)
        and np.array_equal(pose.position, other.poses[frame][1].position)
        for frame, (_, pose) in one.poses.items()
    )
