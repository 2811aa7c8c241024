"""Runs of cases in several processes; what is kept for the same sources and inputs is not run again."""

import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing import get_context

import cv2
import numba

from benchmarks.harness import cache
from benchmarks.harness.case import Case, Figures, Kind


@dataclass(frozen=True)
class Done:
    """Result of one run.  problem: why there is none, "" otherwise."""

    case: Case
    figures: Figures
    problem: str = ""


def runs(kind: Kind, cases: Sequence[Case], jobs: int = 1, fresh: bool = False) -> Iterator[Done]:
    """Results in the order of completion, kept ones first.  jobs: processes; one for what is timed.  fresh: keep none."""
    waiting, columns = [], frozenset(column.name for column in kind.columns)
    for one in cases:
        found = None if fresh else cache.read(kind, one)
        if found is None:
            waiting.append((kind.run, columns, one))
        else:
            yield Done(one, found)
    if kind.timed or jobs <= 1 or len(waiting) <= 1:
        yield from _kept(kind, map(_run, waiting), fresh)
        return
    with get_context("spawn").Pool(jobs, _use_one_core) as pool:
        yield from _kept(kind, pool.imap_unordered(_run, waiting), fresh)


def _kept(kind: Kind, found: Iterator[Done], fresh: bool) -> Iterator[Done]:
    for done in found:
        if not fresh and not done.problem:
            cache.write(kind, done.case, done.figures)
        yield done


def _run(task: tuple[Callable[[Case], Figures], frozenset[str], Case]) -> Done:
    run, columns, one = task
    try:
        figures = {name: float(value) for name, value in run(one).items()}
        if unknown := set(figures) - columns:
            raise ValueError(f"figures without a column: {', '.join(sorted(unknown))}")
    except Exception:  # a case that fails does not end the others
        return Done(one, {}, traceback.format_exc())
    return Done(one, figures)


def _use_one_core() -> None:
    cv2.setNumThreads(1)
    numba.set_num_threads(1)
