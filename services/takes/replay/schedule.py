"""When a message is due: the place on a replay's time line at any moment, with rate, pause and seeking.  Pure."""

from dataclasses import dataclass, replace

RATES = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0)  # what the keys + and - choose from
MAX_RATE = 1000.0


@dataclass(frozen=True)
class Playhead:
    """At `anchor_ns` of a clock that never goes back, the replay was at `place_ns` of its time line.

    rate: seconds of the time line per second; 0 for no clock at all: everything is due, and places are only set.
    """

    place_ns: int
    anchor_ns: int
    rate: float = 1.0
    paused: bool = False

    def place_at(self, now_ns: int) -> int:
        """The place reached at `now_ns`."""
        if self.paused or not self.rate:
            return self.place_ns
        return self.place_ns + round((now_ns - self.anchor_ns) * self.rate)

    def due_ns(self, place_ns: int) -> int | None:
        """When `place_ns` is reached by the clock; None while paused.  Never before the anchor."""
        if self.paused:
            return None
        if not self.rate:
            return self.anchor_ns
        return self.anchor_ns + max(0, round((place_ns - self.place_ns) / self.rate))

    def moved(self, place_ns: int, now_ns: int) -> "Playhead":
        """At another place from `now_ns` on."""
        return replace(self, place_ns=place_ns, anchor_ns=now_ns)

    def toggled(self, now_ns: int) -> "Playhead":
        """Paused, or going on where it was paused."""
        return replace(self.moved(self.place_at(now_ns), now_ns), paused=not self.paused)

    def at_rate(self, rate: float, now_ns: int) -> "Playhead":
        """Going on from the same place at another rate."""
        return replace(self.moved(self.place_at(now_ns), now_ns), rate=rate)


def faster(rate: float) -> float:
    """The next of RATES above; the rate itself above the last, and 0 (no clock) stays."""
    return next((choice for choice in RATES if choice > rate), rate) if rate else rate


def slower(rate: float) -> float:
    """The next of RATES below; the rate itself below the first.  From 0 (no clock) the fastest."""
    return next((choice for choice in reversed(RATES) if choice < rate), rate) if rate else RATES[-1]
