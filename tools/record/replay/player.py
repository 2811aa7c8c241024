"""Loop of a replay: wait until a message is due, publish it, handle keys."""

import logging
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from zenocap.common.bus.protocol import Bus
from zenocap.common.runtime.clock import Clock
from zenocap.common.runtime.keyboard import Key
from zenocap.common.runtime.logs import OncePerSource
from zenocap.tools.record.replay.consumers import Consumers
from zenocap.tools.record.replay.pacing import Playhead, Timer, faster, slower
from zenocap.tools.record.replay.playlist import Playlist, PreparedMessage, ReplayPlan, Start
from zenocap.tools.record.replay.prefetch import Prefetch
from zenocap.tools.record.replay.time_shift import ReplayProgress, Shift, continued

logger = logging.getLogger(__name__)

POLL_NS, REMOTE_POLL_NS = 50_000_000, 10_000_000  # between polls of keys, bus and signals; of a replay that a page controls
POLL_MARGIN_NS = 5_000_000  # longest duration of a poll
STALL_NS = 1_000_000_000  # lateness that shows that the process was stopped; it continues from there
JUMP_NS = 5_000_000_000
SHOWN_NS = 100_000_000  # of the take that a paused replay publishes when it is moved, at most one message of each key


@dataclass(frozen=True)
class Status:
    """Status of a replay.

    place_ns: in the takes; the replayed part is begin_ns to end_ns.  rate: 0 for as fast as consumers keep up.
    bad: number of skipped invalid messages, such as those of another version.
    shift_ns, shift_frames: added to recorded capture times and frame numbers.
    """

    place_ns: int
    begin_ns: int
    end_ns: int
    rate: float
    paused: bool
    lap: int
    sent: int
    bad: int = 0
    shift_ns: int = 0
    shift_frames: int = 0


@dataclass(frozen=True)
class Command:
    """Command of a program; None changes nothing.  place_ns: from the start of the replayed part."""

    paused: bool | None = None
    place_ns: int | None = None
    rate: float | None = None

    def followed_by(self, later: "Command") -> "Command":
        """Both as one command."""
        return replace(self, **{name: value for name, value in vars(later).items() if value is not None})


class CommandSource(Protocol):
    """Source of keys and commands."""

    def pressed(self) -> Sequence[Key | Command]:
        """Keys and commands since the last call; never blocks."""


class Player:
    """Plays a plan once.  show: gets the status several times a second, and before the first message of another shift.

    now: move times to the present.  poll_ns: between polls of keys, bus and signals.
    """

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        timer: Timer,
        plan: ReplayPlan,
        consumers: Consumers,
        keyboard: CommandSource,
        show: Callable[[Status], None],
        *,
        rate: float = 1.0,
        paused: bool = False,
        now: bool = False,
        poll_ns: int = POLL_NS,
    ) -> None:
        self._bus, self._clock, self._timer, self._plan = bus, clock, timer, plan
        self._consumers, self._keyboard, self._show = consumers, keyboard, show
        self._now, self._period_ns = now, poll_ns
        self._head = Playhead(0, clock.elapsed_ns(), rate, paused)
        self._log_once, self.bad = OncePerSource(logger), Counter[str]()
        self.sent = self.late_ns = self.stalls = 0
        self._place_ns, self._lap = plan.begin_ns, 1
        self._reached: ReplayProgress | None = None
        self._shift = Shift(clock.now_ns() - plan.timeline.log_at(plan.begin_ns) if now else 0)
        self._step: set[str] | None = None  # keys published in the current single step
        self._step_end_ns: int | None = None  # of a step that began at a place to which a program moved; None: no end
        self._poll_ns = 0
        self._quit = False
        self._prefetch = self._read_from(Start(plan.begin_ns, 0, 1, self._shift))

    def run(self, stopped: Callable[[], bool]) -> None:
        """Play until the end, `stopped`, or the key to quit.  Raises UserError, BusError and DuplicateService."""
        try:
            self._prefetch.peek(1.0)
            if not self._head.rate:
                self._consumers.keep_pace()
            self._head = self._head.moved(0, self._clock.elapsed_ns())
            while not stopped() and not self._quit:
                prepared = self._prefetch.peek(self._period_ns / 1e9)
                if prepared is not None:
                    self._play(prepared)
                elif self._prefetch.ended:
                    break
                else:
                    self._poll()
            if not self._head.rate:
                self._consumers.keep_pace()
        finally:
            self._prefetch.close()

    @property
    def status(self) -> Status:
        plan, head = self._plan, self._head
        return Status(
            self._place_ns, plan.begin_ns, plan.end_ns, head.rate, head.paused, self._lap, self.sent, self.bad.total(),
            self._shift.time_ns, self._shift.frames,
        )  # fmt: skip

    def _play(self, prepared: PreparedMessage) -> None:
        """Publish the next message if it is due, else wait."""
        if self._step is not None and not prepared.state:
            if prepared.key not in self._step and (self._step_end_ns is None or prepared.place_ns < self._step_end_ns):
                self._step.add(prepared.key)
                self._head = self._head.moved(prepared.line_ns, self._clock.elapsed_ns())
                self._send(prepared)
                return
            self._step = None
        now_ns = self._clock.elapsed_ns()
        due_ns = now_ns if prepared.state else self._head.due_ns(prepared.line_ns)
        left_ns = self._period_ns if due_ns is None else due_ns - now_ns
        if now_ns >= self._poll_ns and (left_ns > POLL_MARGIN_NS or now_ns >= self._poll_ns + 4 * self._period_ns):
            self._poll()  # may change rate, place and pause
            return
        if due_ns is None or left_ns > self._period_ns:
            self._timer.until(now_ns + self._period_ns)
            return
        self._timer.until(due_ns)
        if not prepared.state and self._head.rate:
            late_ns = self._clock.elapsed_ns() - due_ns
            self.late_ns = max(self.late_ns, late_ns)
            if late_ns > STALL_NS:
                self.stalls += 1
                self._head = self._head.moved(prepared.line_ns, self._clock.elapsed_ns())
        self._send(prepared)

    def _send(self, prepared: PreparedMessage) -> None:
        if not self._head.rate:
            self._consumers.send(prepared.topic, prepared.key)
        if prepared.shift != self._shift:  # first, so that the time of the message in the take is known
            self._shift = prepared.shift
            self._show(self.status)
        self._bus.forward(prepared.topic, prepared.key, prepared.data)
        self._prefetch.take()
        self.sent += 1
        if not prepared.state:
            self._place_ns, self._lap = prepared.place_ns, prepared.lap
            before = self._reached or ReplayProgress()
            self._reached = before.advanced(prepared.captured_ns, prepared.frame, prepared.log_ns)
            if not self._head.rate:  # another rate continues from here
                self._head = self._head.moved(prepared.line_ns, self._clock.elapsed_ns())

    def _poll(self) -> None:
        self._consumers.poll()
        for pressed in self._keyboard.pressed():
            if isinstance(pressed, Command):
                self._execute(pressed)
            else:
                self._press(pressed)
        self._show(self.status)
        self._poll_ns = self._clock.elapsed_ns() + self._period_ns

    def _press(self, key: Key) -> None:
        now_ns = self._clock.elapsed_ns()
        match key:
            case Key.PAUSE:
                self._step = None
                self._head = self._head.toggled(now_ns)
            case Key.STEP:
                self._head = self._head if self._head.paused else self._head.toggled(now_ns)
                self._step, self._step_end_ns = set(), None
            case Key.FASTER:
                self._head = self._head.at_rate(faster(self._head.rate), now_ns)
            case Key.SLOWER:
                self._head = self._head.at_rate(slower(self._head.rate), now_ns)
            case Key.BACK:
                self._seek(self._place_ns - JUMP_NS)
            case Key.AHEAD:
                self._seek(self._place_ns + JUMP_NS)
            case Key.QUIT:
                self._quit = True

    def _execute(self, command: Command) -> None:
        now_ns = self._clock.elapsed_ns()
        if command.rate is not None:
            self._head = self._head.at_rate(command.rate, now_ns)
        if command.place_ns is not None:
            self._seek(self._plan.begin_ns + command.place_ns)
        if command.paused is not None and command.paused != self._head.paused:
            self._step = None
            self._head = self._head.toggled(now_ns)
        if command.place_ns is not None and self._head.paused:
            self._step = set()  # shows what is at that place
            self._step_end_ns = self._place_ns + max(self._plan.period_ns, SHOWN_NS)

    def _seek(self, place_ns: int) -> None:
        """Continue from another place; times and frame numbers keep rising, also when seeking back."""
        plan = self._plan
        place_ns = min(max(place_ns, plan.begin_ns), plan.end_ns - 1)
        log_ns, shift = plan.timeline.log_at(place_ns), self._shift
        if self._reached is not None:
            shift = continued(shift, self._reached, log_ns, 0, plan.period_ns)
        if self._now:
            shift = Shift(self._clock.now_ns() - log_ns, shift.frames)
        now_ns = self._clock.elapsed_ns()
        line_ns = self._head.place_at(now_ns)
        self._head = self._head.moved(line_ns, now_ns)
        self._prefetch.close()
        self._prefetch = self._read_from(Start(place_ns, line_ns, self._lap, shift))
        self._place_ns, self._step = place_ns, None

    def _read_from(self, start: Start) -> Prefetch:
        return Prefetch(Playlist(self._plan, start, self._log_once, self.bad))
