"""The part of a take's log between two bounds, each a frame number or a time."""

from zenocap.common.formats.pose_track import Bound
from zenocap.common.recording.reader import Recorded
from zenocap.common.topics import BOTH_WAYS_POSE, SIGHTING, SILHOUETTE, TRACKER_POSE, UNIVERSAL_BAP, topic_at

# Topics whose MCAP sequence number is the frame number.
NUMBERED = (SIGHTING, SILHOUETTE, UNIVERSAL_BAP, TRACKER_POSE, BOTH_WAYS_POSE)


def frame_of(recorded: Recorded) -> int | None:
    """Frame number of a recorded message; None for topics that are not published once per frame."""
    return recorded.sequence if topic_at(recorded.topic) in NUMBERED else None


class TakePart:
    """The part of a log between two bounds, from the first message of the first frame to the last message of the last.

    Times are seconds since the first message of the take.
    """

    def __init__(self, first: Bound | None, last: Bound | None) -> None:
        self._first, self._last = first, last
        self._start_ns: int | None = None
        self._began, self._ended = first is None, False

    def includes(self, recorded: Recorded) -> bool:
        """Whether the next message of the take belongs to the part."""
        if self._start_ns is None:
            self._start_ns = recorded.log_ns
        seconds = (recorded.log_ns - self._start_ns) / 1e9
        frame = frame_of(recorded)
        if not self._began and self._first is not None:
            place = seconds if self._first.seconds else frame
            self._began = place is not None and place >= self._first.value
        if not self._ended and self._last is not None:
            place = seconds if self._last.seconds else frame
            self._ended = place is not None and place > self._last.value
        return self._began and not self._ended
