"""Times of a video's frames from the time stamps of its container, and what is notable about them."""

from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import pairwise

GAP_PERIODS = 1.9  # median frame periods between two frames, from which frames are missing
UNEVEN = 0.25  # deviation of an interval from a multiple of the median period that makes a rate variable
UNEVEN_SHARE, UNEVEN_COUNT = 0.05, 3  # of the intervals, and how many at least, from which a rate is variable


@dataclass
class FrameTimes:
    """Times of frames in the order of presentation, nanoseconds from the first one on; they always increase.

    period_ns: nominal, for frames without a time stamp, or with one that does not increase.  start_ns: of the first frame.
    estimated: number of those.  times_ns: of all frames so far.
    """

    time_base: Fraction
    period_ns: int
    start_ns: int = 0
    estimated: int = 0
    times_ns: "array[int]" = field(default_factory=lambda: array("q"))
    _first: int | None = None

    @property
    def begin_ns(self) -> int:
        """Time stamp of time 0, nanoseconds: of the first frame, less `start_ns`; 0 without one."""
        return 0 if self._first is None else round(self._first * self.time_base * 10**9)

    def next(self, stamp: int | None) -> int:
        """Time of the next frame.  stamp: in units of the time base; None when the container has none."""
        last = self.times_ns[-1] if self.times_ns else self.start_ns - self.period_ns
        if stamp is None:
            time_ns = last
        else:
            if self._first is None:
                self._first = stamp - round(Fraction(last + self.period_ns, 10**9) / self.time_base)
            time_ns = round((stamp - self._first) * self.time_base * 10**9)
        if time_ns <= last:
            time_ns = last + self.period_ns
            self.estimated += bool(self.times_ns)
        self.times_ns.append(time_ns)
        return time_ns


@dataclass(frozen=True)
class Gap:
    """Missing frames: the times in seconds of the frames before and after them, and how many are missing."""

    before_s: float
    after_s: float
    missing: int


@dataclass(frozen=True)
class Timing:
    """Findings in the frame times of a video.

    frames: their number.  duration_s: from the first frame to the last.  rate: frames/s, of the intervals near the median
    one, since containers round times.  shortest_s, longest_s: intervals, without gaps.  variable: whether many intervals
    differ from the median one.
    """

    frames: int
    duration_s: float
    rate: float
    shortest_s: float
    longest_s: float
    variable: bool
    gaps: tuple[Gap, ...]


def timing_of(times_ns: Sequence[int]) -> Timing:
    """Timing of increasing frame times."""
    if len(times_ns) < 2:
        return Timing(len(times_ns), 0.0, 0.0, 0.0, 0.0, False, ())
    intervals = [(b - a) / 1e9 for a, b in pairwise(times_ns)]
    median = sorted(intervals)[len(intervals) // 2]
    uneven = sum(abs(interval - max(1, round(interval / median)) * median) > UNEVEN * median for interval in intervals)
    variable = uneven >= max(UNEVEN_COUNT, UNEVEN_SHARE * len(intervals))
    least = GAP_PERIODS * (2.0 if variable else 1.0) * median
    gaps = tuple(
        Gap(times_ns[k] / 1e9, times_ns[k + 1] / 1e9, round(interval / median) - 1)
        for k, interval in enumerate(intervals)
        if interval > least
    )
    even = [interval for interval in intervals if interval <= least]
    duration = (times_ns[-1] - times_ns[0]) / 1e9
    near = [interval for interval in intervals if abs(interval - median) <= UNEVEN * median]
    return Timing(len(times_ns), duration, len(near) / sum(near), min(even), max(even), variable, gaps)
