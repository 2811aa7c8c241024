"""Capture times as near to the sensor as a source gives them, and the true rate of a source."""

from collections import deque
from itertools import pairwise
from statistics import median

LARGEST_AGE_NS = 2_000_000_000  # of a camera's frame when it is received; older stamps are of another clock; chosen by hand
WINDOW_NS = 10_000_000_000  # over which the least delay of a stream is taken; drift of clocks in it is below 1 ms
RATE_ERROR = 0.01  # of a stream's clock to this machine's, from which it is no clock: an assumed frame rate; chosen by hand
FRAMES = 150  # over which rate and jitter are measured; chosen by hand


def buffer_age_ns(stamp_ms: float, monotonic_ns: int) -> int:
    """Age of a frame of Video4Linux2, nanoseconds; 0 where its stamp is none of the monotonic clock.

    stamp_ms: v4l2_buffer.timestamp, which OpenCV gives as CAP_PROP_POS_MSEC; most drivers set it at the start or end of
    the frame's transfer.
    """
    age_ns = monotonic_ns - round(stamp_ms * 1e6)
    return age_ns if stamp_ms > 0 and 0 <= age_ns < LARGEST_AGE_NS else 0


class StreamClock:
    """Capture times of a stream from its own times, without the jitter of the network.

    A frame's own time plus the least delay of the last seconds, up to a constant.  The constant part of the delay, in the
    camera and on the way, stays.  Until the stream's clock has run for a whole window at the rate of this machine's, and
    where it does not, frames have the time when they were received.
    """

    def __init__(self) -> None:
        self._delays: deque[tuple[int, int]] = deque()  # time of receipt and delay, ns
        self._last_ns: int | None = None
        self._begin_ns = 0

    def captured_ns(self, own_ns: int, received_ns: int) -> int:
        """Capture time.  own_ns: time of the frame in the stream, of any zero.  received_ns: never decreases."""
        if self._last_ns is None or own_ns <= self._last_ns:
            self._delays.clear()
            self._begin_ns = received_ns
        self._last_ns = own_ns
        self._delays.append((received_ns, received_ns - own_ns))
        while received_ns - self._delays[0][0] > WINDOW_NS:
            self._delays.popleft()
        if received_ns - self._begin_ns < WINDOW_NS:
            return received_ns
        middle_ns = received_ns - WINDOW_NS // 2
        earlier = min((delay for time, delay in self._delays if time <= middle_ns), default=None)
        later = min(delay for time, delay in self._delays if time > middle_ns)
        if earlier is None or abs(later - earlier) > RATE_ERROR * WINDOW_NS / 2:
            return received_ns
        return own_ns + min(earlier, later)


class SourceRate:
    """Rate and jitter of a source, of its capture times before any frame is left out."""

    def __init__(self) -> None:
        self._times: deque[int] = deque(maxlen=FRAMES)
        self.returns = 0  # how often the source was opened again after a failure

    def add(self, captured_ns: int) -> None:
        self._times.append(captured_ns)

    def restart(self) -> None:
        """Begin again after a failure."""
        self._times.clear()
        self.returns += 1

    def counts(self) -> dict[str, int]:
        """For health.  source_jitter_us: 95 % of the intervals are this near the median one."""
        times = list(self._times.copy())  # another thread adds to it
        if len(times) < 3:
            return {"source_returns": self.returns}
        intervals = [b - a for a, b in pairwise(times)]
        typical = median(intervals)
        jitter_ns = sorted(abs(interval - typical) for interval in intervals)[int(0.95 * (len(intervals) - 1))]
        rate = round((len(times) - 1) * 1e12 / (times[-1] - times[0])) if times[-1] > times[0] else 0
        return {
            "source_frames_per_1000_s": rate, "source_jitter_us": round(jitter_ns / 1e3), "source_returns": self.returns,
        }  # fmt: skip
