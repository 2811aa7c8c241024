"""Reader of the two takes of a comparison, in a thread."""

import logging
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.bus.protocol import Envelope
from zenocap.common.conversion import Bap, angles_of, is_lost, lost_parts
from zenocap.common.errors import UserError, reading
from zenocap.common.formats.pose_track import PoseTrack, rate_of
from zenocap.common.formats.take_poses import TOPICS_USED, summary_of
from zenocap.common.messages import TrackerPose, UniversalBap
from zenocap.common.recording.reader import TakeReader
from zenocap.common.recording.summary import read_summary
from zenocap.common.topics import BOTH_WAYS_POSE, TRACKER_POSE, UNIVERSAL_BAP, Topic
from zenocap.services.animator.comparison import TakeComparison, TimedTrack

logger = logging.getLogger(__name__)

Stopped = Callable[[], bool]


class ReadingStopped(Exception):
    """The takes are not needed any more."""


@dataclass(frozen=True, slots=True)
class _Row:
    """A pose without what a comparison does not need.  names: of the angles."""

    position: tuple[float, float, float]
    names: tuple[str, ...]
    angles: Floats
    lost: str
    has_pose: bool


def read_track(path: Path, *, raw: bool = False, stopped: Stopped = lambda: False) -> TimedTrack:
    """Poses of a take as `take_poses.read_poses` has them, without scores, views and limbs.

    raw: see `read_poses`.  Raises UserError for a take that cannot be read or has no poses, and ReadingStopped.
    """
    if not path.is_file():
        raise UserError(f"{path}: no such file")
    rows: dict[type[Bap], dict[int, _Row]] = {}
    summary = summary_of(path, raw=raw, envelopes=_read(path, raw, stopped, rows))
    count, of_kind, anatomy = len(summary.captured_ns), rows[summary.kind], summary.anatomy
    positions, angles = np.full((count, 3), np.nan), np.full((count, len(anatomy.angles)), np.nan)
    lost = []
    for k, captured_ns in enumerate(summary.captured_ns.tolist()):
        row = of_kind[captured_ns]
        lost.append(row.lost)
        if row.has_pose:
            positions[k] = row.position
            angles[k] = angles_of(anatomy, dict(zip(row.names, row.angles.tolist(), strict=True)), anatomy.neutral)
    times_s = (summary.captured_ns - summary.start_ns) / 1e9
    track = PoseTrack(
        anatomy, summary.bdp, summary.frames, times_s, positions, angles, {}, {}, tuple(lost),
        rate_of(summary.frames, times_s),
    )  # fmt: skip
    return TimedTrack(path.name, summary.captured_ns, track)


def compare(
    one: Path, other: Path, offset_s: float = 0.0, *, raw: bool = False, stopped: Stopped = lambda: False
) -> TakeComparison:
    """Read two takes.  raw, errors: see `read_track`."""
    first, second = (read_track(path, raw=raw, stopped=stopped) for path in (one, other))
    return TakeComparison(first, second, offset_s)


class ComparisonReader:
    """Reads a comparison in a thread, from `start` to `close`.

    found: None until it is read.  problem: why it cannot be read, "" otherwise.
    """

    def __init__(self, read: Callable[[Stopped], TakeComparison], on_found: Callable[[TakeComparison], None]) -> None:
        self._read, self._on_found = read, on_found
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="comparison", daemon=True)
        self.found: TakeComparison | None = None
        self.problem = ""

    def start(self) -> None:
        self._thread.start()

    def close(self) -> None:
        """Stop reading."""
        self._ended.set()
        if self._thread.is_alive():
            self._thread.join()

    def _run(self) -> None:
        begun_s = time.monotonic()
        try:
            found = self._read(self._ended.is_set)
        except ReadingStopped:
            return
        except UserError as error:
            self.problem = str(error)
            return
        logger.info("both takes are compared: read in %.1f s", time.monotonic() - begun_s)
        self.found = found
        self._on_found(found)


def _read(path: Path, raw: bool, stopped: Stopped, rows: dict[type[Bap], dict[int, _Row]]) -> Iterator[Envelope]:
    """Yield the messages of a take with bodies, poses and cameras, and keep the poses in `rows`, by kind and capture time.

    Raises ReadingStopped, and UserError.
    """
    names: dict[tuple[str, ...], tuple[str, ...]] = {}  # one object each
    for envelope in TakeReader(path).envelopes(_topics(path, raw)):
        if stopped():
            raise ReadingStopped
        bap = envelope.message
        if isinstance(bap, UniversalBap | TrackerPose):
            keys = tuple(bap.angles)
            keys = names.setdefault(keys, keys)
            values = np.array(list(bap.angles.values()))
            row = _Row(bap.position, keys, values, " ".join(lost_parts(bap)), not is_lost(bap))
            rows.setdefault(type(bap), {})[bap.captured_ns] = row
        yield envelope


def _topics(path: Path, raw: bool) -> frozenset[Topic]:
    """Topics to decode: without the poses of one direction that are not used, where the take has an index."""
    with reading(path):
        summary = read_summary(path)
    both = not raw and summary is not None and summary.ids(BOTH_WAYS_POSE)
    unused = {TRACKER_POSE, UNIVERSAL_BAP} if both else {BOTH_WAYS_POSE} if raw else set()
    return frozenset(TOPICS_USED) - unused
