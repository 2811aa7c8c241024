"""From the rows of a manifest to examples: angles of takes and of files of motion capture, as feature vectors."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from common.body.anatomy import TEN_PARTS, Floats
from common.formats.motions import read_poses_for
from common.formats.poses import read_poses
from common.formats.track import every_frame
from common.formats.trc import FormatError
from common.take.reading import TakeError
from services.recognizer.examples import LEAST_ROWS, Example
from services.recognizer.features import Kind, features_of
from services.recognizer.manifest import ManifestError, Row
from services.recognizer.sequences import bridged

EXACT_S = 1e-6
KEPT = 4  # sources at a time: the rows of a manifest mostly stand together


@dataclass(frozen=True)
class Features:
    """features: (T, 10) radians, NaN where there is no pose.  times_s: (T,) seconds from the start of the source.

    rate: frames per second.
    """

    rate: float
    times_s: Floats
    features: Floats


def examples_of(
    manifest: Path,
    rows: Sequence[Row],
    kind: Kind,
    report: Callable[[int, int, str], None] = lambda done, of, words: None,
    missing: list[str] | None = None,
) -> list[Example]:
    """The examples of a manifest's rows, in order.  Raises ManifestError with all that cannot be used, a line each.

    missing: takes these lines instead; one for each row.
    """
    examples: list[Example] = []
    wrong: list[str] = []
    read = lru_cache(KEPT)(features_in)
    failed: dict[Path, str] = {}
    for done, row in enumerate(rows):
        report(done, len(rows), row.source.name)
        if row.source in failed:
            if missing is not None:
                wrong.append(f"{manifest}: line {row.line}: {failed[row.source]}")
            continue
        try:
            motion = read(row.source, kind)
        except (FormatError, TakeError, OSError) as error:
            failed[row.source] = str(error)
            wrong.append(f"{manifest}: line {row.line}: {error}")
            continue
        try:
            features = stretch(motion, row.start, row.end)
        except ValueError as error:
            wrong.append(f"{manifest}: {row}: {error}")
            continue
        name = f"{manifest}: {row}"
        examples.append(Example(row.posture, row.person, row.repetition, motion.rate, features, name))
    report(len(rows), len(rows), "done")
    if missing is not None:
        missing += wrong
    elif wrong:
        raise ManifestError("\n".join(wrong))
    return examples


def features_in(path: Path, kind: Kind) -> Features:
    """All of a source: of a take in its own anatomy, of a .bvh or .trc in ten parts.  Raises FormatError and TakeError."""
    if path.suffix.lower() == ".mcap":
        track = every_frame(read_poses(path).track(), 0)
        if not track.rate > 0:
            raise FormatError(f"{path}: {len(track.frames)} frames with a pose: allowed: two or more")
        return Features(track.rate, track.times_s, features_of(track.anatomy, track.angles, kind))
    motion = read_poses_for(path, TEN_PARTS)
    angles = np.full((len(motion.poses), len(TEN_PARTS.angles)), np.nan)
    for row, pose in enumerate(motion.poses):
        if pose is not None and motion.known[row]:
            angles[row] = pose.angles
    return Features(motion.rate, motion.times_s, features_of(TEN_PARTS, angles, kind))


def stretch(motion: Features, start: float | None, end: float | None) -> Floats:
    """(T, 10) the frames from `start` to `end`, short gaps bridged; None: from the first pose, to the last one.

    Raises ValueError for fewer than two frames and for gaps of more than `sequences.MAX_GAP_S`.
    """
    times_s, known = motion.times_s, np.flatnonzero(np.isfinite(motion.features).all(axis=1))
    if not len(known):
        raise ValueError("no angles in any frame: allowed: a source in which the person is tracked")
    first_s = times_s[known[0]] if start is None else start
    last_s = times_s[known[-1]] if end is None else end
    rows = np.flatnonzero((times_s >= first_s - EXACT_S) & (times_s <= last_s + EXACT_S))
    if len(rows) < LEAST_ROWS:
        spans = f"{LEAST_ROWS} or more, of {times_s[0]:.2f} s to {times_s[-1]:.2f} s at {motion.rate:g}/s"
        raise ValueError(f"{len(rows)} frames: allowed: {spans}")
    return bridged(motion.features[rows], motion.rate, float(times_s[rows[0]]))
