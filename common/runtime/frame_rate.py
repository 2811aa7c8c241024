"""Choice of frames under overload: all viewers of a rig process the same frame sets.

The integrator decides which share of the frames is processed, and publishes it as `FrameRate`.  Frame sets are numbered by
slots: capture times on the integrator's clock in frame periods of the rig.  Of every `of` slots `keep` are kept, evenly
spread: slot s is kept when floor(s keep / of) is greater than for slot s - 1.  The frame nearest to a kept slot is
processed.  The integrator chooses the phase of the slots so that the capture times of no viewer are in the middle between
two of them, where jitter would decide.  Viewers report their phases.
"""

from collections.abc import Collection
from dataclasses import dataclass
from itertools import count, pairwise

from zenocap.common.messages import FrameRate, Health
from zenocap.common.runtime.clock_offset import Offset, to_integrator_ns

# Counts of a viewer's health.
PROCESSED, DROPPED, SKIPPED, OVERRUN, KEPT_PERCENT, PHASE_US, CAPTURED = (
    "frames", "dropped_frames", "skipped_frames", "overrun_frames", "kept_percent", "phase_us", "captured_frames",
)  # fmt: skip
FARTHEST_NS = 10_000_000_000  # ns between a decision and the time from which it holds, at most; chosen by hand
SLOWEST_HZ = 5.0  # frames/s, the least that remain: tracking fails between them; chosen by hand
MOST_LATE = 10_000  # late frames that are counted one by one; of more, the clock was set forward; chosen by hand
OVERTAKEN_NS = 1_000_000_000  # ns by which a message that another has overtaken is older, at most; chosen by hand


@dataclass(frozen=True)
class Share:
    """Share of the slots that are kept: `keep` of every `of`."""

    keep: int = 1
    of: int = 1

    @property
    def value(self) -> float:
        return self.keep / self.of

    @property
    def percent(self) -> int:
        """As in the health of a viewer, 1 to 100."""
        return max(1, round(100 * self.value))

    @property
    def spacing(self) -> int:
        """Fewest slots from one kept slot to the next."""
        return self.of // self.keep

    def any_after(self, last: int, slot: int) -> bool:
        """Whether a slot is kept after `last`, up to and including `slot`."""
        return slot * self.keep // self.of > last * self.keep // self.of

    def keeps(self, slot: int) -> bool:
        return self.any_after(slot - 1, slot)


FULL = Share()


@dataclass(frozen=True)
class Grid:
    """Slots and the share of them that is kept.  phase_ns: capture time of slot 0."""

    share: Share = FULL
    phase_ns: int = 0


def phase_of(captured_ns: int, fps: float) -> int:
    """Time since the last multiple of the frame period, ns."""
    return int(captured_ns * fps % 1e9 / fps)


def common_phase(phases_ns: Collection[int], fps: float) -> int:
    """Phase of the slots from which the phases of all viewers are far from half a period, ns; 0 without viewers."""
    if not phases_ns:
        return 0
    period_ns = 1e9 / fps
    phases = sorted(phases_ns)
    gaps = [(after - before, before) for before, after in pairwise([*phases, phases[0] + period_ns])]
    gap_ns, before = max(gaps)  # half a period from the slots is in its middle
    return int((before + gap_ns / 2 + period_ns / 2) % period_ns)


def farthest_phase(phases_ns: Collection[int], phase_ns: int, fps: float) -> float:
    """Largest distance of the viewers' phases from that of the slots, in periods: at most half of one."""
    period_ns = 1e9 / fps
    offsets = ((phase - phase_ns) / period_ns % 1.0 for phase in phases_ns)
    return max((min(offset, 1.0 - offset) for offset in offsets), default=0.0)


def share_of(message: FrameRate) -> Share:
    """The share in a message; everything when it is impossible."""
    return Share(message.keep, message.of) if message.keep <= message.of else FULL


def is_too_slow(message: FrameRate, fps: float) -> bool:
    """Whether a decision leaves fewer than SLOWEST_HZ of `fps` frames/s: it is no integrator's, and not followed."""
    share = share_of(message)
    return share != FULL and share.value * fps < 0.99 * SLOWEST_HZ


def is_overtaken(message: FrameRate, last: FrameRate | None) -> bool:
    """Whether a decision is older than the last one that was followed.

    One that is older by more than OVERTAKEN_NS is not: the time of the last was wrong, or forged.
    """
    last_ns = last.captured_ns if last is not None else 0
    return last_ns - OVERTAKEN_NS <= message.captured_ns < last_ns


def time_after(last_ns: int, now_ns: int) -> int:
    """Time of a decision that is followed after one of last_ns: now, or just after one that is little ahead."""
    return last_ns + 1 if 0 <= last_ns - now_ns <= OVERTAKEN_NS else now_ns


def holds_from_ns(message: FrameRate) -> int:
    """Capture time from which a decision holds; its own time when the one in it is impossible."""
    near = abs(message.from_ns - message.captured_ns) <= FARTHEST_NS
    return message.from_ns if near else message.captured_ns


def describe(message: FrameRate | None) -> str:
    """Text for people, such as "reduced to 15 of 30 frames/s: processor of viewer 1"; empty at the full rate."""
    if message is None or share_of(message) == FULL:
        return ""
    text = f"reduced to {_rate(message.fps * share_of(message).value)} of {_rate(message.fps)} frames/s"
    if message.limit != "viewers" or not message.viewers:
        return f"{text}: processor of the {message.limit}" if message.limit else text
    several = len(message.viewers) > 1
    return f"{text}: processor of {f'{len(message.viewers)} viewers' if several else f'viewer {message.viewers[0]}'}"


def reduced_text(message: FrameRate | None, detail: float) -> str:
    """The text of the rate and of the tracker's share of points and particles; empty when nothing is left out."""
    thinned = "" if detail == 1 else f"tracker with {detail:.0%} of its points"
    return "; ".join(text for text in (describe(message), thinned) if text)


def _rate(fps: float) -> str:
    return f"{round(fps, 1):g}"


class FrameChoice:
    """The frames of one live source that are processed, and those that were lost.

    `wants` and `next_index` are for the thread of the source, the others for the loop of the service.
    fps: of the rig.
    late: frames that the source dropped because they were late.  skipped: frames left out on purpose.
    """

    def __init__(self, fps: float) -> None:
        self._fps = fps
        self._offset: Offset | None = None
        self._last_slot: int | None = None
        self._grids = (Grid(), 0, Grid())  # before, and from a capture time on the integrator's clock
        self._phase_ns = 0
        self._message: FrameRate | None = None
        self._losses = self._overrun = 0
        self.late = self.skipped = 0

    @property
    def share(self) -> Share:
        return self._grids[2].share

    def set_rate(self, message: FrameRate) -> None:
        """Follow a decision of the integrator, unless it is older than the last, or too slow."""
        if is_too_slow(message, self._fps) or is_overtaken(message, self._message):
            return
        self._message = message
        self._grids = (self._grids[2], holds_from_ns(message), Grid(share_of(message), message.phase_ns))

    def wants(self, captured_ns: int) -> bool:
        """Whether the next frame of the source is to be processed; a frame that is not is counted.

        It is when a slot was kept since the frame before: a frame that comes late for its slot replaces it.
        """
        slot, share = self._slot(captured_ns)
        last = self._last_slot
        # A clock that was set back, and a source that begins, have no frame before.
        if share == FULL or last is None or slot < last - share.of or share.any_after(last, slot):
            self._last_slot = slot
            return True
        self.skipped += 1
        return False

    def next_index(self, first: int, due: int, epoch_ns: int, fps: float) -> int:
        """Number of the next frame to process, `first` or later; those before `due` are late.

        Frame k has the capture time `epoch_ns` + k / fps.
        """

        if self._last_slot is None:  # begins, perhaps after the epoch
            first = max(first, due)
        late = max(0, due - first - MOST_LATE)
        for index in count(first + late):
            captured_ns = epoch_ns + round(index * 1e9 / fps)
            slot, share = self._slot(captured_ns)
            if share != FULL and (slot == self._last_slot or not share.keeps(slot)):
                continue
            self._last_slot = slot
            if index >= due:
                break
            late += 1
        self.late += late
        self.skipped += index - first - late
        return index

    def begin_frame(self, losses: int) -> None:
        """Note that a frame is processed next.  losses: lost and late frames so far."""
        self._overrun += losses > self._losses
        self._losses = losses

    def set_clock_offset(self, offset: Offset | None) -> None:
        """Set the offset of this clock to the integrator's."""
        self._offset = offset

    def counts(self) -> dict[str, int]:
        """Counts for the health.

        Overrun frames: processed ones before which others were lost, or answered too late.  Phase: capture time of the last
        frame on the integrator's clock modulo the frame period of the rig, microseconds.
        """
        kept, phase_us = self.share.percent, self._phase_ns // 1000
        return {OVERRUN: self._overrun, SKIPPED: self.skipped, KEPT_PERCENT: kept, PHASE_US: phase_us}

    def describe(self) -> str:
        """Health text; empty at the full rate."""
        rate = self._fps * self.share.value
        return "" if self.share == FULL else f"reduced to {_rate(rate)} of {_rate(self._fps)} frames/s"

    def _slot(self, captured_ns: int) -> tuple[int, Share]:
        """Slot of a capture time, and the share of the slots that are kept then."""
        captured_ns = to_integrator_ns(captured_ns, self._offset)
        self._phase_ns = phase_of(captured_ns, self._fps)
        before, from_ns, after = self._grids
        grid = after if captured_ns >= from_ns else before
        return round((captured_ns - grid.phase_ns) * self._fps / 1e9), grid.share


@dataclass(frozen=True)
class ViewerCounts:
    """Frames of a viewer since its start: processed, dropped, and overrun as in `FrameChoice.counts`."""

    processed: int
    dropped: int
    overrun: int


def counts_in(health: Health) -> ViewerCounts:
    """The counts of a viewer's health; 0 where it has none."""
    counts = health.counts
    return ViewerCounts(counts.get(PROCESSED, 0), counts.get(DROPPED, 0), counts.get(OVERRUN, 0))
