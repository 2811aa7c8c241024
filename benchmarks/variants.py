"""The two-view method as printed, with each addition alone, without each, and with all: the table of docs/papers.md.

    python -m benchmarks.variants [--only NAME ...] [--seeds 3] [--people 12] [--size 160x120] [--motions] [--clips]

NAME is `paper`, `improved`, `+ADDITION` (the paper with it) or `-ADDITION` (improved without it), or several of one
sign, as in `-tilt-turn`; names that begin with - are given as `--only=NAME`; or `hybrid`, the tracker with the same two
cameras, or `hybrid-OPTION`, the tracker without one of its options.  Simulated people, 15 postures, two takes each, scored
from the start of the posture against the true body; the worst seed in brackets.
--motions: motion capture instead of postures (the shared files that are not in the clips), at 30 frames/s.
--clips: the shared clips instead, by `score_trc.py`.
"""

import argparse
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from multiprocessing import Pool
from pathlib import Path
from time import perf_counter

import cv2
import msgspec
import numpy as np

from benchmarks.clips import SCORE, SHARED, scored
from benchmarks.errors import Estimate, FrameError, frame_error, summary
from benchmarks.loop import track_film, tracker_film
from benchmarks.table import Cell, table
from benchmarks.takes import PEOPLE, SMALL, CapturedTake, Film, Size, Take, captured_takes, default_folder, film, takes
from zenocap.common.rig.tracker import DEFAULT_FILTER
from zenocap.common.rig.two_view import ADDITIONS, IMPROVED, PAPER, Additions
from zenocap.simulation.motion.posture_style import POSTURES

MOTIONS = ("02_04", "02_07", "02_08", "07_01", "07_05", "10_01")  # jump, sword, broom, walks, kick; not in the clips
CLIPS = ("walk2", "bend2", "kick2", "turned2")
HYBRID = "hybrid"  # the tracker with its defaults and the same two cameras
PARTS = {f"{HYBRID}-{name}": name for name, value in msgspec.structs.asdict(DEFAULT_FILTER).items() if value is True}
NAMES = (
    "paper",
    *(f"+{name}" for name in ADDITIONS),
    *(f"-{name}" for name in ADDITIONS),
    "improved",
    HYBRID,
)  # without those of PARTS


@dataclass(frozen=True)
class TakeResult:
    """errors: of the scored frames.  searches: tri-tree searches by limb kind, with their matchings.  ms: per frame."""

    errors: tuple[FrameError, ...]
    matchings: tuple[float, float, float]
    ms: float


def additions(name: str) -> Additions:
    """Additions of a variant's name.  Raises ValueError for an unknown one."""
    if name in ("paper", "improved"):
        return PAPER if name == "paper" else IMPROVED
    named = frozenset(name[1:].split(name[:1])) if name[:1] in ("+", "-") else frozenset({name})
    if unknown := named - set(ADDITIONS):
        raise ValueError(
            f"{name}: {', '.join(sorted(unknown))} unknown: allowed: paper, improved, + or - {', '.join(ADDITIONS)}"
        )
    return PAPER | named if name[0] == "+" else IMPROVED - named


def tracked(take: Take | CapturedTake, names: Sequence[str], folder: Path | None) -> list[TakeResult]:
    """One take by every variant.  folder: where rendered takes are kept."""
    cv2.setNumThreads(1)
    rendered = film(take, folder)
    return [_tracked(rendered, take.fps, name) for name in names]


def _tracked(rendered: Film, fps: float, name: str) -> TakeResult:
    started_s = perf_counter()
    if name == HYBRID or name in PARTS:
        without = {PARTS[name]: False} if name in PARTS else {}
        found = tracker_film(rendered, fps, filter=msgspec.structs.replace(DEFAULT_FILTER, **without))
        ms = 1000 * (perf_counter() - started_s) / len(rendered.truths)
        return TakeResult(_errors(rendered, found.get), (float("nan"),) * 3, ms)
    track = track_film(rendered, fps, additions(name))
    ms = 1000 * (perf_counter() - started_s) / len(rendered.truths)
    arms = [sum(bap.limbs[limb].matchings) for bap in track.partials for limb in bap.limbs if "arm" in limb]
    legs = [sum(bap.limbs[limb].matchings) for bap in track.partials for limb in bap.limbs if "leg" in limb]
    frames = [sum(sum(limb.matchings) for limb in bap.limbs.values()) for bap in track.partials]
    means = [float(np.mean(counts)) if counts else float("nan") for counts in (arms, legs, frames)]
    return TakeResult(_errors(rendered, track.estimate), (means[0], means[1], means[2]), ms)


def _errors(rendered: Film, estimate: Callable[[int], Estimate | None]) -> tuple[FrameError, ...]:
    errors = []
    for k in range(rendered.motion_from, len(rendered.truths)):
        true = rendered.truths[k]
        assert true is not None, "the person is in the scene from the initial posture on"
        errors.append(frame_error(estimate(k), true))
    return tuple(errors)


def variant(name: str) -> str:
    """The name, checked for the command line."""
    try:
        if name != HYBRID and name not in PARTS:
            additions(name)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
    return name


def worst(values: Sequence[float], digits: int = 1) -> str:
    """Mean, and the largest in brackets."""
    return f"{np.mean(values):.{digits}f} ({np.max(values):.{digits}f})"


def chosen_takes(options: argparse.Namespace, seed: int, size: Size) -> Sequence[Take | CapturedTake]:
    if not options.motions:
        return takes(seed, options.people, tuple(options.posture), size)
    return captured_takes([SHARED / "motions" / f"cmu_{name}.bvh" for name in MOTIONS], seed, options.people, size)


def people_rows(names: Sequence[str], options: argparse.Namespace, size: tuple[int, int]) -> list[list[Cell]]:
    every: list[list[list[TakeResult]]] = []  # by set of people, take and variant
    folder = default_folder() if size == SMALL else None  # larger ones need too much space
    with Pool(options.jobs) as pool:
        for seed in range(options.first_seed, options.first_seed + options.seeds):
            chosen = chosen_takes(options, seed, size)
            found = pool.imap(partial(tracked, names=names, folder=folder), chosen, chunksize=1)
            every.append(list(with_progress(found, len(chosen), f"set {seed}")))
    return [_people_row(name, [[take[k] for take in found] for found in every]) for k, name in enumerate(names)]


def _people_row(name: str, results: Sequence[Sequence[TakeResult]]) -> list[Cell]:
    """results: by set of people and take."""
    columns = np.array([summary([e for one in found for e in one.errors]) for found in results])
    every = [one for found in results for one in found]
    counts = np.nanmean([one.matchings for one in every], axis=0)
    means = [worst(columns[:, k].tolist(), 0 if k == 3 else 1) for k in range(1, 6)]
    return [name, *means, *(f"{count:.0f}" for count in counts), f"{np.median([one.ms for one in every]):.1f}"]


def with_progress(found: Iterable[list[TakeResult]], count: int, name: str) -> Iterator[list[TakeResult]]:
    """The same, with a line for every tenth of `count`."""
    for k, one in enumerate(found, 1):
        if k * 10 // count > (k - 1) * 10 // count:
            print(f"{name}: {k} of {count} takes", flush=True)
        yield one


def clip_rows(names: Sequence[str], jobs: int, size: tuple[int, int]) -> list[list[Cell]]:
    rows: list[list[Cell]] = []
    with Pool(jobs) as pool:
        for name in names:
            found = pool.map(
                partial(scored, clips=SHARED / "clips", additions=additions(name)), [(clip, size) for clip in CLIPS], 1
            )
            cells = [
                f"{one['mpjpe_mm']:.0f} / {one['shape_mm']:.0f} / {one['lost_pct']:.1f}" if one else "never starts"
                for one in found
            ]
            rows.append([name, *cells])
            print("  ".join(str(cell) for cell in rows[-1]), flush=True)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", action="extend", nargs="+", type=variant, metavar="NAME")
    parser.add_argument("--seeds", type=int, default=3, help="sets of people (default 3)")
    parser.add_argument("--first-seed", type=int, default=0, help="the first set (default 0)")
    parser.add_argument("--people", type=int, default=PEOPLE, help=f"of a set (default {PEOPLE})")
    parser.add_argument("--posture", nargs="+", choices=POSTURES, default=POSTURES, metavar="NAME")
    parser.add_argument("--size", default="160x120", metavar="WxH")
    parser.add_argument("--motions", action="store_true", help="the shared motion capture files instead of postures")
    parser.add_argument("--clips", action="store_true", help="the shared clips")
    parser.add_argument("--jobs", type=int, default=2, help="processes (default 2)")
    options = parser.parse_args()
    names = options.only or NAMES
    width, height = (int(number) for number in options.size.split("x"))
    shared = [SHARED / "motions" / f"cmu_{name}.bvh" for name in MOTIONS] if options.motions else []
    shared += [SCORE, *(SHARED / "clips" / name for name in CLIPS)] if options.clips else []
    if missing := [str(path) for path in shared if not path.exists()]:
        print(f"variants: skipped: {', '.join(missing)} missing (the shared test data are expected beside the checkout)")
        return
    if options.clips:
        rows = clip_rows(names, options.jobs, (width, height))
        print(table("Clips: mean mm / shape mm / lost %", ("variant", *CLIPS), rows))
        return
    rows = people_rows(names, options, (width, height))
    columns = (
        "variant", "segment deg", "median", "joint mm", "yaw deg", "lost %", "matchings arm", "leg", "view", "ms a frame"
    )  # fmt: skip
    print(table(f"{options.seeds} sets of {options.people} people, {options.size}; worst set in brackets", columns, rows))


if __name__ == "__main__":
    main()
