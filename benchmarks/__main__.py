"""Run kinds of benchmarks: print their tables, store and publish their figures.

    python -m benchmarks KIND ... [--only TEXT ...] [--seeds N] [--jobs N] [--fresh] [--publish]
    python -m benchmarks --list
    python -m benchmarks --stale            # lists stored figures whose sources have changed since; measures nothing
    python -m benchmarks --publish          # only writes the pages again
    python -m benchmarks --pictures NAME ... [--folder docs]

KIND may be `all`.  What needs the shared clips beside the checkout is skipped without them; the status is 1 where a named
kind has then no case left, where a case fails, and where a limit of a case does not hold.
"""

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import cast

from rich.console import Console

from benchmarks.harness import pages, results
from benchmarks.harness.cache import ROOT, source_digest
from benchmarks.harness.case import Kind
from benchmarks.harness.pool import runs
from benchmarks.harness.text import show
from benchmarks.kinds import KINDS
from benchmarks.pictures import DRAWN
from zenocap.common.errors import UserError
from zenocap.common.table import attribute

FEWEST_SEEDS = 3  # of a figure that is published, unless nothing is random


def main(arguments: Sequence[str] | None = None) -> int:
    options = parser().parse_args(arguments)
    if not (options.kind or options.list or options.stale or options.publish or options.pictures):
        parser().error("KIND, --list, --stale, --publish or --pictures expected")
    if options.publish and options.small:
        parser().error("--publish with --small: figures of the smallest case have no meaning")
    try:
        if options.list or options.stale:
            for line in _listed() if options.list else _stale():
                print(line)
            return 0
        for name in options.pictures:
            cast(Callable[[Path], None], attribute(DRAWN[name]))(options.folder)
        names = KINDS.names() if options.kind == ["all"] else options.kind
        failed = [name for name in names if not _measured(KINDS.row(name), options, named=options.kind != ["all"])]
        for page in pages.publish(results.load_all()) if options.publish else ():
            print(f"written: {page}")
        return 1 if failed else 0
    except UserError as error:
        print(error, file=sys.stderr)
        return 1


def parser() -> argparse.ArgumentParser:
    found = argparse.ArgumentParser(
        "python -m benchmarks", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    found.add_argument("kind", nargs="*", help="kinds, or `all`")
    found.add_argument("--list", action="store_true", help="list kinds and cases")
    found.add_argument("--stale", action="store_true", help="list stored figures whose sources have changed since")
    found.add_argument("--only", nargs="+", default=(), metavar="TEXT", help="cases of these names, or with these in them")
    found.add_argument("--seeds", type=int, metavar="N", help="seeds of a case (default: those of the kind)")
    found.add_argument("--jobs", type=int, default=2, metavar="N", help="processes (default 2); timed kinds have one")
    found.add_argument("--fresh", action="store_true", help="run again what is kept for the same sources and inputs")
    found.add_argument("--small", action="store_true", help="only the smallest case, one seed: checks that a kind runs")
    found.add_argument("--publish", action="store_true", help="store the figures and write them into the pages")
    found.add_argument("--pictures", nargs="+", default=(), choices=DRAWN, help="draw pictures of the documentation")
    found.add_argument("--folder", type=Path, default=ROOT / "docs", help="of the pictures (default docs)")
    return found


def _listed() -> list[str]:
    return [line for key, one in KINDS.rows().items() for line in (f"{key}: {one.about}", *map("    {}".format, one.cases))]


def _stale() -> list[str]:
    return [line for name, found in results.load_all().items() for line in results.stale(found, KINDS.row(name))]


def _measured(kind: Kind, options: argparse.Namespace, *, named: bool) -> bool:
    """Run the chosen cases; False where one failed, or where a kind that the user named has none.  Raises UserError."""
    chosen = {"smallest": kind.small} if options.small else dict(kind.selected(options.only))
    seeds = 1 if options.small else options.seeds or kind.seeds
    if options.publish and seeds < min(FEWEST_SEEDS, kind.seeds):
        raise UserError(f"{kind.name}: --seeds {seeds} with --publish: allowed: {min(FEWEST_SEEDS, kind.seeds)} and more")
    for name, case in list(chosen.items()):
        if missing := kind.missing(case):
            print(f"{kind.name}: {name}: skipped: {', '.join(missing)} missing (expected in `shared` beside the checkout)")
            del chosen[name]
    sources = {name: source_digest(kind, case) for name, case in chosen.items()}  # as the run begins
    wanted = {name: [case.of_seed(seed) for seed in range(seeds)] for name, case in chosen.items()}
    every = list(dict.fromkeys(case for cases in wanted.values() for case in cases))
    found, failed = {}, named and not chosen
    for number, done in enumerate(runs(kind, every, options.jobs, options.fresh or options.small), 1):
        found[done.case] = done.figures
        failed |= bool(done.problem)
        print(f"{time.strftime('%H:%M:%S')} {kind.name}: {number} of {len(every)}: {done.case}", flush=True)
        if done.problem:
            print(done.problem, file=sys.stderr, flush=True)
    rows = [
        results.summary(name, kind, [found[case] for case in cases], sources[name])
        for name, cases in wanted.items()
        if all(found[case] for case in cases)
    ]
    if rows:
        shown = results.results_of(kind, rows)
        show(shown, rows, Console())
        for row in rows:
            if row.figures.get(results.HOLDS, [1.0])[-1] == 0.0:  # of the worst seed
                failed = True
                print(f"{kind.name}: {row.case}: a limit does not hold", file=sys.stderr)
        if options.publish:
            results.store(kind, rows)
    return not failed


if __name__ == "__main__":
    sys.exit(main())
