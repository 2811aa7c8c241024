"""Messages of a later time: what is said of frames and capture times, moved by the same steps everywhere.  Pure."""

from dataclasses import dataclass

import msgspec

from common import messages as m


@dataclass(frozen=True)
class Shift:
    """What is added to capture times (nanoseconds) and frame numbers; nothing, and the bytes stay as recorded."""

    time_ns: int = 0
    frames: int = 0

    def __bool__(self) -> bool:
        return bool(self.time_ns or self.frames)


def shifted(message: m.Message, shift: Shift) -> m.Message:
    """The message `shift` later.  Frames it refers to move as its own do, except -1, which stands for none."""
    later = msgspec.structs.replace(
        message, captured_ns=message.captured_ns + shift.time_ns, frame=message.frame + shift.frames
    )
    match later:
        case m.Sighting(based_on=based_on) | m.PartialBap(based_on=based_on) if based_on >= 0:
            return msgspec.structs.replace(later, based_on=based_on + shift.frames)
        case m.Assignment(views=views):
            answered = {
                viewer: msgspec.structs.replace(view, frame=view.frame + shift.frames) for viewer, view in views.items()
            }
            return msgspec.structs.replace(later, views=answered)
        case _:
            return later


@dataclass(frozen=True)
class Reached:
    """The latest of what was sent: as sent, and the time line of the takes (log_ns).  Sums up with `further`."""

    captured_ns: int
    frame: int
    log_ns: int

    def further(self, captured_ns: int, frame: int, log_ns: int) -> "Reached":
        return Reached(max(self.captured_ns, captured_ns), max(self.frame, frame), log_ns)


def going_on(shift: Shift, reached: Reached, next_log_ns: int, lowest_frame: int, gap_ns: int) -> Shift:
    """The shift with which what was logged at `next_log_ns` follows what was reached, `gap_ns` later.

    lowest_frame: of what follows, as recorded.  Jumping ahead needs no other shift.
    """
    if next_log_ns > reached.log_ns:
        return shift
    return Shift(shift.time_ns + reached.log_ns - next_log_ns + gap_ns, reached.frame + 1 - lowest_frame)
