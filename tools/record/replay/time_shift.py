"""Shift capture times and frame numbers of messages.  Pure."""

from dataclasses import dataclass

from msgspec.structs import replace

from zenocap.common import messages as m


@dataclass(frozen=True)
class Shift:
    """Offset of capture times (nanoseconds) and frame numbers; zero leaves the bytes as recorded."""

    time_ns: int = 0
    frames: int = 0

    def __bool__(self) -> bool:
        return bool(self.time_ns or self.frames)


def shifted(message: m.Message, shift: Shift) -> m.Message:
    """The message `shift` later.  Frame numbers it refers to move with its own, except -1 (none)."""
    later = replace(message, captured_ns=message.captured_ns + shift.time_ns, frame=message.frame + shift.frames)
    match later:
        case m.Sighting(based_on=based_on) | m.PartialBap(based_on=based_on) if based_on >= 0:
            return replace(later, based_on=based_on + shift.frames)
        case m.Assignment(views=views):
            answered = {viewer: replace(view, frame=view.frame + shift.frames) for viewer, view in views.items()}
            return replace(later, views=answered)
        case _:
            return later


@dataclass(frozen=True)
class ReplayProgress:
    """Latest capture time and frame number as published, and log time of the take; updated with `advanced`."""

    captured_ns: int = 0
    frame: int = 0
    log_ns: int = 0

    def advanced(self, captured_ns: int, frame: int, log_ns: int) -> "ReplayProgress":
        return ReplayProgress(max(self.captured_ns, captured_ns), max(self.frame, frame), log_ns)


def continued(shift: Shift, reached: ReplayProgress, next_log_ns: int, lowest_frame: int, gap_ns: int) -> Shift:
    """Shift with which the message logged at `next_log_ns` follows what was published, `gap_ns` later.

    lowest_frame: of the messages that follow, as recorded.  Seeking forward keeps the shift.
    """
    if next_log_ns > reached.log_ns:
        return shift
    return Shift(shift.time_ns + reached.log_ns - next_log_ns + gap_ns, reached.frame + 1 - lowest_frame)
