"""The player's loop: wait until a message is due, send it, heed keys."""

import logging
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from common.bus.protocol import Bus
from common.runtime.clock import Clock
from common.runtime.keys import Key
from common.runtime.logs import OncePerSource
from services.takes.replay.ahead import Ahead
from services.takes.replay.consumers import Consumers
from services.takes.replay.laps import Laps, Plan, Ready, Start
from services.takes.replay.schedule import Playhead, faster, slower
from services.takes.replay.shifting import Reached, Shift, going_on
from services.takes.replay.waiting import Waiting

logger = logging.getLogger(__name__)

LOOK_NS = 50_000_000  # between looks at keys and bus, so also how soon a signal is heeded
SLACK_NS = 5_000_000  # a look may take that long
HELD_UP_NS = 1_000_000_000  # later than this, the process was stopped or the machine asleep: it goes on from there
JUMP_NS = 5_000_000_000


@dataclass(frozen=True)
class Status:
    """place_ns: in the takes; the replayed part is begin_ns to end_ns.  rate: 0 for as fast as consumers keep up.

    bad: messages that are not valid, as those of another version, and were left out.
    """

    place_ns: int
    begin_ns: int
    end_ns: int
    rate: float
    paused: bool
    lap: int
    sent: int
    bad: int = 0


@dataclass(frozen=True)
class Order:
    """What a program asks for; None leaves it as it is.  place_ns: from the beginning of the replayed part."""

    paused: bool | None = None
    place_ns: int | None = None
    rate: float | None = None


class Orders(Protocol):
    """Where keys and orders come from."""

    def pressed(self) -> Sequence[Key | Order]:
        """Those since the last time; never waits."""


class Player:
    """Plays a plan once.  show: is told the status several times a second.  now: times are moved to the present."""

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        waiting: Waiting,
        plan: Plan,
        consumers: Consumers,
        keyboard: Orders,
        show: Callable[[Status], None],
        *,
        rate: float = 1.0,
        paused: bool = False,
        now: bool = False,
    ) -> None:
        self._bus, self._clock, self._waiting, self._plan = bus, clock, waiting, plan
        self._consumers, self._keyboard, self._show = consumers, keyboard, show
        self._now = now
        self._head = Playhead(0, clock.elapsed_ns(), rate, paused)
        self._once, self.bad = OncePerSource(logger), Counter[str]()
        self.sent = self.late_ns = self.held_up = 0
        self._place_ns, self._lap = plan.begin_ns, 1
        self._reached: Reached | None = None
        self._shift = Shift(clock.now_ns() - plan.timeline.log_at(plan.begin_ns) if now else 0)
        self._step: set[str] | None = None  # keys sent in the step that is being made
        self._look_ns = 0
        self._quit = False
        self._ahead = self._read_from(Start(plan.begin_ns, 0, 1, self._shift))

    def run(self, stopped: Callable[[], bool]) -> None:
        """Until the end, `stopped`, or the key to quit.  Raises TakeError, BusError and DuplicateService."""
        try:
            self._ahead.peek(1.0)
            if not self._head.rate:
                self._consumers.keep_pace()
            self._head = self._head.moved(0, self._clock.elapsed_ns())
            while not stopped() and not self._quit:
                ready = self._ahead.peek(LOOK_NS / 1e9)
                if ready is not None:
                    self._play(ready)
                elif self._ahead.ended:
                    break
                else:
                    self._look()
            if not self._head.rate:
                self._consumers.keep_pace()
        finally:
            self._ahead.close()

    @property
    def status(self) -> Status:
        plan = self._plan
        head = self._head
        bad = self.bad.total()
        return Status(self._place_ns, plan.begin_ns, plan.end_ns, head.rate, head.paused, self._lap, self.sent, bad)

    def _play(self, ready: Ready) -> None:
        """Send the next message if its time has come, else let some time pass."""
        if self._step is not None and not ready.state:
            if ready.key not in self._step:
                self._step.add(ready.key)
                self._head = self._head.moved(ready.line_ns, self._clock.elapsed_ns())
                self._send(ready)
                return
            self._step = None
        now_ns = self._clock.elapsed_ns()
        due_ns = now_ns if ready.state else self._head.due_ns(ready.line_ns)
        left_ns = LOOK_NS if due_ns is None else due_ns - now_ns
        if now_ns >= self._look_ns and (left_ns > SLACK_NS or now_ns >= self._look_ns + 4 * LOOK_NS):
            self._look()  # may change everything
            return
        if due_ns is None or left_ns > LOOK_NS:
            self._waiting.until(now_ns + LOOK_NS)
            return
        self._waiting.until(due_ns)
        if not ready.state and self._head.rate:
            late_ns = self._clock.elapsed_ns() - due_ns
            self.late_ns = max(self.late_ns, late_ns)
            if late_ns > HELD_UP_NS:
                self.held_up += 1
                self._head = self._head.moved(ready.line_ns, self._clock.elapsed_ns())
        self._send(ready)

    def _send(self, ready: Ready) -> None:
        if not self._head.rate:
            self._consumers.send(ready.topic, ready.key)
        self._bus.forward(ready.topic, ready.key, ready.data)
        self._ahead.take()
        self.sent += 1
        self._shift = ready.shift
        if not ready.state:
            self._place_ns, self._lap = ready.place_ns, ready.lap
            before = self._reached or Reached(0, 0, 0)
            self._reached = before.further(ready.captured_ns, ready.frame, ready.log_ns)
            if not self._head.rate:  # so that another rate goes on from here
                self._head = self._head.moved(ready.line_ns, self._clock.elapsed_ns())

    def _look(self) -> None:
        self._consumers.hear()
        for pressed in self._keyboard.pressed():
            if isinstance(pressed, Order):
                self._obey(pressed)
            else:
                self._press(pressed)
        self._show(self.status)
        self._look_ns = self._clock.elapsed_ns() + LOOK_NS

    def _press(self, key: Key) -> None:
        now_ns = self._clock.elapsed_ns()
        match key:
            case Key.PAUSE:
                self._step = None
                self._head = self._head.toggled(now_ns)
            case Key.STEP:
                self._head = self._head if self._head.paused else self._head.toggled(now_ns)
                self._step = set()
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

    def _obey(self, order: Order) -> None:
        now_ns = self._clock.elapsed_ns()
        if order.rate is not None:
            self._head = self._head.at_rate(order.rate, now_ns)
        if order.place_ns is not None:
            self._seek(self._plan.begin_ns + order.place_ns)
        if order.paused is not None and order.paused != self._head.paused:
            self._step = None
            self._head = self._head.toggled(now_ns)

    def _seek(self, place_ns: int) -> None:
        """Go on from another place: times and frames go on rising, also backwards."""
        plan = self._plan
        place_ns = min(max(place_ns, plan.begin_ns), plan.end_ns - 1)
        log_ns, shift = plan.timeline.log_at(place_ns), self._shift
        if self._reached is not None:
            shift = going_on(shift, self._reached, log_ns, 0, plan.period_ns)
        if self._now:
            shift = Shift(self._clock.now_ns() - log_ns, shift.frames)
        now_ns = self._clock.elapsed_ns()
        line_ns = self._head.place_at(now_ns)
        self._head = self._head.moved(line_ns, now_ns)
        self._ahead.close()
        self._ahead = self._read_from(Start(place_ns, line_ns, self._lap, shift))
        self._place_ns, self._step = place_ns, None

    def _read_from(self, start: Start) -> Ahead:
        return Ahead(Laps(self._plan, start, self._once, self.bad))
