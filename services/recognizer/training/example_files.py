"""Reading of examples: rows of takes and motion-capture files, by the rows of a manifest."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.proportions import average_lengths, body_from_lengths
from zenocap.common.errors import UserError
from zenocap.common.formats.file_warnings import grouped_warnings
from zenocap.common.formats.joint_map import JointMap
from zenocap.common.formats.motion_files import read_poses_for
from zenocap.common.formats.pose_track import PoseTrack, every_frame
from zenocap.common.formats.take_poses import read_poses
from zenocap.services.recognizer.features import Kind
from zenocap.services.recognizer.motion_rows import rows_of
from zenocap.services.recognizer.training.examples import BACKGROUND, LEAST_ROWS, Example, fill_gaps, gaps
from zenocap.services.recognizer.training.manifest import ManifestRow, relative, summarized
from zenocap.services.recognizer.training.parameters import LEAST_BACKGROUND_S

EXACT_S = 1e-6
AVERAGE_HEIGHT_M = 1.72  # of the figure for motion capture, which has no measured body
CACHED_SOURCES = 4  # rows of the same source are mostly adjacent in a manifest


@dataclass(frozen=True)
class Features:
    """Rows of a source.

    features: (T, `motion_rows.WIDTH`), NaN in frames without a pose.  times_s: (T,) seconds from the start of the source.
    rate: frames per second.
    """

    rate: float
    times_s: Floats
    features: Floats


@grouped_warnings()
def examples_of(
    manifest: Path,
    rows: Sequence[ManifestRow],
    kind: Kind,
    report: Callable[[int, int, str], None] = lambda done, of, text: None,
    missing: list[str] | None = None,
    joints: JointMap | None = None,
) -> list[Example]:
    """Examples of a manifest's rows, in order.  Raises UserError with the unusable rows, see `manifest.summarized`.

    missing: receives these lines instead of raising.  joints: of the files of motion capture.  Equal warnings about several
    files are one line, see `grouped_warnings`.
    """
    examples: list[Example] = []
    wrong: list[str] = []
    base = manifest.parent

    @lru_cache(CACHED_SOURCES)
    def read(source: Path) -> Features:
        return read_features(source, kind, joints)

    failed: dict[Path, str] = {}
    for done, row in enumerate(rows):
        report(done, len(rows), row.source.name)
        if row.source in failed:
            if missing is not None:
                wrong.append(f"{manifest}: line {row.line}: {failed[row.source]}")
            continue
        try:
            motion = read(row.source)
        except (UserError, OSError) as error:
            failed[row.source] = str(error).replace(str(row.source), str(relative(row.source, base)))
            wrong.append(f"{manifest}: line {row.line}: {failed[row.source]}")
            continue
        name = f"{manifest}: {row.text(base)}"
        if row.posture == BACKGROUND:
            found = _background(motion, row, name)
            examples += found
            if not found:
                least = f"allowed: {LEAST_BACKGROUND_S:g} s or more without a gap"
                wrong.append(f"{name}: background without a stretch of angles: {least}")
            continue
        try:
            features = span(motion, row.start, row.end)
        except ValueError as error:
            wrong.append(f"{name}: {error}")
            continue
        examples.append(Example(row.posture, row.person, row.repetition, motion.rate, features, name))
    report(len(rows), len(rows), "done")
    if missing is not None:
        missing += wrong
    elif wrong:
        raise UserError("\n".join(summarized(wrong)))
    return examples


def _background(motion: Features, row: ManifestRow, name: str) -> list[Example]:
    """Stretches of a row without gaps, of LEAST_BACKGROUND_S or more."""
    known = np.isfinite(motion.features).all(axis=1)
    known &= motion.times_s >= (motion.times_s[0] if row.start is None else row.start) - EXACT_S
    known &= motion.times_s <= (motion.times_s[-1] if row.end is None else row.end) + EXACT_S
    least = max(LEAST_ROWS, round(LEAST_BACKGROUND_S * motion.rate))
    return [
        Example(row.posture, row.person, row.repetition, motion.rate, motion.features[start:end], name)
        for start, end in gaps(~known)
        if end - start >= least
    ]


def read_features(path: Path, kind: Kind, joints: JointMap | None = None) -> Features:
    """Rows of a whole source, see `read_track`.  Raises UserError."""
    track = read_track(path, joints)
    if not track.rate > 0:
        raise UserError(f"{path}: {len(track.frames)} frames with a pose: allowed: two or more")
    return features_of(track, kind)


def features_of(track: PoseTrack, kind: Kind) -> Features:
    """Rows of a track."""
    return Features(track.rate, track.times_s, rows_of(track.anatomy, track.positions, track.angles, kind))


def read_track(path: Path, joints: JointMap | None = None) -> PoseTrack:
    """Every frame of a source: a take in its own anatomy, a .bvh, .trc or .c3d in ten parts, with an average body.

    joints: names of joints and markers of motion capture that are not recognized.  Raises UserError.
    """
    if path.suffix.lower() == ".mcap":
        return every_frame(read_poses(path).track(), 0)
    motion = read_poses_for(path, TEN_PARTS, joints=joints)
    count = len(motion.poses)
    positions, angles = np.full((count, 3), np.nan), np.full((count, len(TEN_PARTS.angles)), np.nan)
    for row, pose in enumerate(motion.poses):
        if pose is not None and motion.known[row]:
            positions[row], angles[row] = pose.position, pose.angles
    return PoseTrack(
        anatomy=TEN_PARTS, bdp=body_from_lengths(TEN_PARTS, average_lengths(AVERAGE_HEIGHT_M)), frames=np.arange(count),
        times_s=motion.times_s, positions=positions, angles=angles, scores={}, views={},
        lost=tuple("person" if np.isnan(place[0]) else "" for place in positions), rate=motion.rate,
    )  # fmt: skip


def span(motion: Features, start: float | None, end: float | None) -> Floats:
    """(T, d) frames from `start` to `end` (s), short gaps filled; None: from the first pose, to the last one.

    Raises ValueError for fewer than two frames and for long gaps, see `examples.fill_gaps`.
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
    return fill_gaps(motion.features[rows], motion.rate, float(times_s[rows[0]]))
