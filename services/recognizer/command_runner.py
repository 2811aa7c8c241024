"""Runner of commands beside the service loop: a thread and a bounded queue for each."""

import logging
import queue
import threading
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Literal

import msgspec

from zenocap.common.messages import CommandResult, Posture
from zenocap.common.rig.commands import HttpAction, OscAction, PostureCommand, ProgramAction, UdpAction, ZenohAction
from zenocap.common.runtime.clock import Clock
from zenocap.common.runtime.clock_offset import Offset, to_integrator_ns
from zenocap.services.recognizer.actions import ActionFailed, ProgramRunner, Put, put, request_http, send_osc, send_udp
from zenocap.services.recognizer.commands import CommandState, Trigger, triggered
from zenocap.services.recognizer.event_text import PostureEvent, filled, filled_action
from zenocap.services.recognizer.parameters import COMMANDS_WAITING, STOP_TIMEOUT_S

logger = logging.getLogger(__name__)

MAX_ERROR = 1000  # letters of a `CommandResult`
VARIABLES = ("rig", "posture", "confidence", "begin", "end", "count")  # placeholders that a program gets


class CommandRunner:
    """Triggers and performs the commands of one rig.

    All methods are called by the service loop and do not block, except `close`.  put: puts bytes on a Zenoh key, callable
    from any thread.  wake: makes the loop fetch `results`, callable from any thread.
    """

    def __init__(
        self, rig: str, commands: Sequence[PostureCommand], put: Put, wake: Callable[[], None], clock: Clock
    ) -> None:
        self._rig, self._commands, self._put, self._wake, self._clock = rig, tuple(commands), put, wake, clock
        self._state = CommandState()
        self._offset: Offset | None = None
        self._counts = Counter[str]()
        self._published = 0
        self._results: queue.SimpleQueue[CommandResult] = queue.SimpleQueue()
        self._workers = [_Worker(f"{rig} {command.key}", self._perform) for command in self._commands]

    def set_clock_offset(self, offset: Offset | None) -> None:
        """Set the offset of this machine's clock to the integrator's, to which capture times refer."""
        self._offset = offset

    def receive(self, posture: Posture) -> None:
        """Queue the commands that a published posture triggers."""
        self._state, triggers = triggered(self._commands, self._state, posture, self._now_ns())
        for trigger in triggers:
            if not self._workers[trigger.number].offer(trigger):
                self._report(trigger, self._now_ns(), "dropped", f"{COMMANDS_WAITING} earlier ones are waiting")

    def results(self) -> Sequence[CommandResult]:
        """Results since the last call, to be published."""
        found: list[CommandResult] = []
        while not self._results.empty():
            result = msgspec.structs.replace(self._results.get(), frame=self._published)
            self._published += 1
            self._counts[f"commands_{result.outcome}"] += 1
            self._log(result)
            found.append(result)
        return found

    def counts(self) -> Mapping[str, int]:
        """Counters for the health: commands done, failed, dropped; not triggered because old, unsure or in the cooldown."""
        if not self._commands:
            return {}
        outcomes = {f"commands_{outcome}": 0 for outcome in ("done", "failed", "dropped")}
        return outcomes | self._counts | {f"commands_{name}": count for name, count in self._state.counts.items()}

    def close(self) -> None:
        """Kill running programs and wait for the other actions, at most STOP_TIMEOUT_S."""
        deadline_ns = self._clock.elapsed_ns() + round(STOP_TIMEOUT_S * 1e9)
        for worker in self._workers:
            worker.stop()
        for worker in self._workers:
            worker.join(max(0.0, (deadline_ns - self._clock.elapsed_ns()) / 1e9))

    def _perform(self, trigger: Trigger, programs: ProgramRunner) -> None:
        """Perform an action, in the thread of its command."""
        sent_ns: list[int] = []

        def on_sent() -> None:
            sent_ns.append(self._now_ns())

        outcome: Literal["done", "failed"] = "done"
        error = ""
        try:
            match filled_action(trigger.command.action, self._event(trigger)):
                case ZenohAction() as action:
                    put(action, self._put, on_sent)
                case OscAction() as action:
                    send_osc(action, on_sent)
                case UdpAction() as action:
                    send_udp(action, on_sent)
                case HttpAction() as action:
                    request_http(action, on_sent)
                case ProgramAction() as action:
                    programs.run(action, self._variables(trigger), on_sent)
        except ActionFailed as failure:
            outcome, error = "failed", str(failure)
        except Exception as failure:  # a bug in an action must not end its thread
            logger.exception("%s: %s", self._rig, trigger.command.key)
            outcome, error = "failed", f"{type(failure).__name__}: {failure}"
        self._report(trigger, sent_ns[0] if sent_ns else self._now_ns(), outcome, error)

    def _variables(self, trigger: Trigger) -> Mapping[str, str]:
        """Environment of a program."""
        event = self._event(trigger)
        return {f"ZENOCAP_{name.upper()}": filled(f"{{{name}}}", event) for name in VARIABLES}

    def _event(self, trigger: Trigger) -> PostureEvent:
        posture = trigger.posture
        return PostureEvent(self._rig, trigger.label, trigger.confidence, posture.start_ns, posture.end_ns, trigger.count)

    def _report(self, trigger: Trigger, acted_ns: int, outcome: Literal["done", "failed", "dropped"], error: str) -> None:
        posture = trigger.posture

        def since(time_ns: int) -> int:
            return max(0, acted_ns - time_ns)

        self._results.put(
            CommandResult(
                frame=0, captured_ns=posture.captured_ns, posture=trigger.label, action=trigger.command.kind,
                target=trigger.command.action.target[:MAX_ERROR], confidence=trigger.confidence,
                latency_ns=since(posture.captured_ns), since_end_ns=since(posture.end_ns),
                since_start_ns=since(posture.start_ns), outcome=outcome, error=error[:MAX_ERROR],
            )
        )  # fmt: skip
        self._wake()

    def _now_ns(self) -> int:
        """Present time on the integrator's clock."""
        return to_integrator_ns(self._clock.now_ns(), self._offset)

    def _log(self, result: CommandResult) -> None:
        name = f"{self._rig}: {result.posture}: {result.action} {result.target}"
        if result.outcome == "done":
            logger.info("%s: %.1f ms after the pose", name, result.latency_ns / 1e6)
        else:
            logger.warning("%s: %s: %s", name, result.outcome, result.error)


class _Worker:
    """Thread that performs the triggers of one command in order."""

    def __init__(self, name: str, perform: Callable[[Trigger, ProgramRunner], None]) -> None:
        self._perform = perform
        self._queue: queue.Queue[Trigger | None] = queue.Queue(COMMANDS_WAITING)
        self._programs = ProgramRunner()
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def offer(self, trigger: Trigger) -> bool:
        """Queue a trigger; returns False when the queue is full."""
        try:
            self._queue.put_nowait(trigger)
        except queue.Full:
            return False
        return True

    def stop(self) -> None:
        """Discard what is waiting, kill a running program, and end after the present action."""
        self._stopped.set()
        self._programs.stop()
        with suppress(queue.Full):  # otherwise the thread takes one of the waiting triggers and ends
            self._queue.put_nowait(None)

    def join(self, timeout_s: float) -> None:
        self._thread.join(timeout_s)

    def _run(self) -> None:
        while True:
            trigger = self._queue.get()
            if trigger is None or self._stopped.is_set():
                return
            self._perform(trigger, self._programs)
