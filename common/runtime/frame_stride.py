"""Frame stride: an overloaded viewer processes every 2^n-th frame, the same frames as the other viewers of its rig.

Frames are numbered by slots: capture times on the integrator's clock in frame periods.  A stride s keeps the slots that are
multiples of s.  Each viewer requests a stride, and all follow the largest; until they have received it they still share
frames, since multiples of 2s are multiples of s.
"""

from collections.abc import Collection
from dataclasses import dataclass, replace
from itertools import count

from zenocap.common.messages import Health
from zenocap.common.runtime.clock_offset import Offset, to_integrator_ns

FRAME_STRIDE, SKIPPED_FRAMES = "frame_stride", "skipped_frames"  # counts of the health; the requested stride
EXPIRES_NS = 3_000_000_000  # ns without a health after which the stride of another viewer is not followed, chosen by hand


LONGEST_PERIOD_NS = 200_000_000  # ns between processed frames, at most: tracking fails between them; chosen by hand


@dataclass(frozen=True)
class StrideSettings:
    """window_ns, window_frames: shortest time and fewest processed frames between two decisions.

    missed: share of frames after a lost or late one above which the stride is doubled; below half of it there is no
    overload.  spare: share of the frame period that the work on most frames must leave free to halve the stride.
    wait_ns, longest_wait_ns: time without overload before the stride is halved; doubled each time the overload returns.
    """

    window_ns: int
    window_frames: int
    missed: float
    spare: float
    wait_ns: int
    longest_wait_ns: int


@dataclass(frozen=True)
class StrideState:
    """stride: requested by this viewer, a power of two.

    since_ns: start of the window.  frames, missed, spare: frames counted in it.  calm_ns: since when there is no overload
    and time to spare.  halved_ns: time of the last halving, None after a doubling.  wait_ns: time without overload before
    the next halving.  Times are of a monotonic clock.
    """

    stride: int = 1
    since_ns: int | None = None
    frames: int = 0
    missed: int = 0
    spare: int = 0
    calm_ns: int = 0
    halved_ns: int | None = None
    wait_ns: int = 0


def observe(
    settings: StrideSettings,
    state: StrideState,
    now_ns: int,
    missed: bool,
    work_ns: int,
    period_ns: int,
    used: int | None = None,
) -> StrideState:
    """State after one more processed frame.  Pure.

    missed: frames before it were lost, or were answered too late.  work_ns: time that the service worked since the frame
    before.  period_ns: frame period of the rig.  used: stride in use, the largest of all viewers; None for the requested.
    """
    used = state.stride if used is None else used
    since_ns = now_ns if state.since_ns is None else state.since_ns
    if now_ns < since_ns:
        return state
    spare = work_ns <= (1.0 - settings.spare) * used * period_ns
    state = replace(
        state, since_ns=since_ns, frames=state.frames + 1, missed=state.missed + missed, spare=state.spare + spare
    )
    if now_ns - since_ns < settings.window_ns or state.frames < settings.window_frames:
        return state
    decided = _decided(settings, state, now_ns, period_ns, used)
    # After a change, messages that are on the way belong to frames of the stride before.
    pause_ns = settings.window_ns // 2 if decided.stride != state.stride else 0
    return replace(decided, since_ns=now_ns + pause_ns, frames=0, missed=0, spare=0)


def _decided(settings: StrideSettings, state: StrideState, now_ns: int, period_ns: int, used: int) -> StrideState:
    """State with the requested stride of the next window."""
    if state.missed > settings.missed * state.frames:
        if state.halved_ns is None:
            wait_ns = max(state.wait_ns, settings.wait_ns)
        elif now_ns - state.halved_ns < state.wait_ns:  # the halving was too early
            wait_ns = min(2 * state.wait_ns, settings.longest_wait_ns)
        else:
            wait_ns = settings.wait_ns
        stride = 2 * used if 2 * used * period_ns <= LONGEST_PERIOD_NS else state.stride
        return replace(state, stride=stride, calm_ns=now_ns, halved_ns=None, wait_ns=wait_ns)
    overloaded = state.missed > 0.5 * settings.missed * state.frames
    if state.stride == 1 or state.stride < used or overloaded or state.spare < 0.9 * state.frames:
        return replace(state, calm_ns=now_ns)
    if now_ns - state.calm_ns < state.wait_ns:
        return state
    return replace(state, stride=state.stride // 2, calm_ns=now_ns, halved_ns=now_ns)


class FrameStride:
    """Stride of one live source.  `wants` and `next_index` are for the thread of the source, the others for the loop.

    origin_ns: capture time of slot 0, common to all viewers of the rig.  others: ids of those that it follows.
    late: frames that the source dropped because they were late.  skipped: frames left out by the stride.
    """

    def __init__(self, settings: StrideSettings, fps: float, origin_ns: int, others: Collection[str] = ()) -> None:
        self._settings, self._fps, self._origin_ns = settings, fps, origin_ns
        self._state = StrideState()
        self._requested: dict[str, tuple[int, int]] = dict.fromkeys(others, (1, 0))
        self._used = 1
        self._offset: Offset | None = None
        self._last_slot: int | None = None
        self._losses = self._busy_ns = 0
        self.late = self.skipped = 0

    @property
    def stride(self) -> int:
        """Stride in use: the largest that a viewer of the rig requests."""
        return self._used

    @property
    def requested(self) -> int:
        return self._state.stride

    def wants(self, captured_ns: int) -> bool:
        """Whether the next frame of the source is to be processed; a frame that is not is counted."""
        slot = self._slot(captured_ns)
        due = slot % self.stride == 0 and slot != self._last_slot
        # A camera that is slower than the rig may miss all multiples.
        overdue = self._last_slot is None or slot - self._last_slot >= 2 * self.stride
        if self.stride == 1 or due or overdue:
            self._last_slot = slot
            return True
        self.skipped += 1
        return False

    def next_index(self, first: int, due: int, epoch_ns: int, fps: float) -> int:
        """Number of the next frame to process, `first` or later; those before `due` are late.

        Frame k has the capture time `epoch_ns` + k / fps.
        """

        def slot(index: int) -> int:
            return self._slot(epoch_ns + round(index * 1e9 / fps))

        index = next(k for k in count(first) if slot(k) % self.stride == 0)
        if index < due:
            late = -(-(due - index) // self.stride)
            index = next(k for k in count(due) if slot(k) % self.stride == 0)
            if self._last_slot is None:  # began after the epoch
                first = index
            else:
                self.late += late
                first += late
        self.skipped += index - first
        self._last_slot = slot(index)
        return index

    def begin_frame(self, now_ns: int, losses: int, busy_ns: int) -> None:
        """Note that a frame is processed next.  losses: lost and late frames so far.  busy_ns: time worked so far."""
        missed, work_ns = losses > self._losses, busy_ns - self._busy_ns
        self._losses, self._busy_ns = losses, busy_ns
        self._state = observe(self._settings, self._state, now_ns, missed, work_ns, self._period_ns, self._used)
        self._update(now_ns)

    def set_other(self, health: Health, now_ns: int) -> None:
        """Follow the stride that another viewer of the rig requests."""
        if health.id in self._requested:
            self._requested[health.id] = stride_in(health, self._period_ns), now_ns
            self._update(now_ns)

    @property
    def _period_ns(self) -> int:
        return round(1e9 / self._fps)

    def _update(self, now_ns: int) -> None:
        recent = (stride for stride, received_ns in self._requested.values() if now_ns - received_ns < EXPIRES_NS)
        self._used = max(self._state.stride, *recent, 1)

    def set_clock_offset(self, offset: Offset | None) -> None:
        """Set the offset of this clock to the integrator's."""
        self._offset = offset

    def counts(self) -> dict[str, int]:
        """Counts for the health."""
        return {FRAME_STRIDE: self._state.stride, SKIPPED_FRAMES: self.skipped}

    def describe(self) -> str:
        """Health text; empty without overload."""
        if self.stride == 1:
            return ""
        return f"overloaded: every {self.stride}{'nd' if self.stride % 10 == 2 else 'th'} frame"

    def _slot(self, captured_ns: int) -> int:
        return round((to_integrator_ns(captured_ns, self._offset) - self._origin_ns) * self._fps / 1e9)


def stride_in(health: Health, period_ns: int) -> int:
    """Frame stride that a viewer requests; 1 for one that is not overloaded, and for an impossible one.

    period_ns: frame period of the rig.
    """
    stride = health.counts.get(FRAME_STRIDE, 1)
    is_power_of_two = stride > 0 and stride & (stride - 1) == 0
    return stride if is_power_of_two and stride * period_ns <= LONGEST_PERIOD_NS else 1
