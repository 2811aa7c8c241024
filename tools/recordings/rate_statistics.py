"""Overload of a take's rig: duration, lowest frame rate."""

from dataclasses import dataclass

from zenocap.common import messages as m
from zenocap.common.runtime.frame_rate import describe, share_of


@dataclass(frozen=True)
class Reduced:
    """Frame rate of an overloaded rig.  seconds: below the rate of the rig, fps; lowest_fps: the lowest; reason: its text.

    thinned_s: seconds with fewer points and particles of the tracker.
    """

    seconds: float
    fps: float
    lowest_fps: float
    reason: str
    thinned_s: float


@dataclass
class RateTally:
    """Decisions on the frame rate.  since_ns, thin_ns: time since which rate and detail are reduced; None for full."""

    fps: float = 0.0
    lowest: m.FrameRate | None = None
    since_ns: int | None = None
    reduced_ns: int = 0
    thin_ns: int | None = None
    thinned_ns: int = 0

    def add(self, message: m.FrameRate | m.TrackerDetail) -> None:
        now_ns = message.captured_ns
        if isinstance(message, m.TrackerDetail):
            self.thinned_ns += 0 if self.thin_ns is None else max(0, now_ns - self.thin_ns)
            self.thin_ns = now_ns if message.share < 1 else None
            return
        self.fps = message.fps
        self.reduced_ns += 0 if self.since_ns is None else max(0, now_ns - self.since_ns)
        share = share_of(message).value
        self.since_ns = now_ns if share < 1 else None
        if share < 1 and (self.lowest is None or share < share_of(self.lowest).value):
            self.lowest = message

    def reduced(self, end_ns: int) -> Reduced | None:
        """The reduction up to the end of the take; None when every frame was processed in full detail."""
        reduced_ns = self.reduced_ns + (0 if self.since_ns is None else max(0, end_ns - self.since_ns))
        thinned_ns = self.thinned_ns + (0 if self.thin_ns is None else max(0, end_ns - self.thin_ns))
        if not reduced_ns and not thinned_ns:
            return None
        lowest = self.fps if self.lowest is None else self.fps * share_of(self.lowest).value
        return Reduced(reduced_ns / 1e9, self.fps, lowest, describe(self.lowest), thinned_ns / 1e9)
