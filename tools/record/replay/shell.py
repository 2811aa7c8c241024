"""The replay process: read takes, open the bus, announce their services, play."""

import logging
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from time import monotonic, sleep

from rich.console import Console

from zenocap.common.bus.protocol import Bus, BusError, DuplicateService
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.errors import UserError
from zenocap.common.formats.pose_track import Bound
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.foreign_text import printable
from zenocap.common.runtime.keyboard import keyboard
from zenocap.common.runtime.logs import terminal_handler
from zenocap.common.topics import service_at, topic_at
from zenocap.tools.record.replay.consumers import Consumers, Name
from zenocap.tools.record.replay.controls import Remote, display, status_lines, status_text, write_status
from zenocap.tools.record.replay.pacing import RealTimer
from zenocap.tools.record.replay.player import POLL_NS, REMOTE_POLL_NS, CommandSource, Player, Status
from zenocap.tools.record.replay.playlist import ReplayPlan
from zenocap.tools.record.replay.remap import Remapping, remapped_keys
from zenocap.tools.record.replay.selection import ReplaySelection
from zenocap.tools.record.replay.timeline import Timeline
from zenocap.tools.takes.take_part import frame_of

logger = logging.getLogger(__name__)

DONE, LOSS = 0, 3
THREAD_SWITCH_S = 0.0005  # longest delay of the publishing thread by the prefetching one; Python's default is 5 ms
FLUSH_S = 0.2  # time to transmit the last messages


@dataclass(frozen=True)
class ReplayOptions:
    """Messages to replay, and how.  first, last: part of the takes.  delay_s: before the start.

    remote: take commands from the program that started it; see `zenocap.tools.record.replay.controls`.
    """

    selection: ReplaySelection
    remapping: Remapping
    first: Bound | None = None
    last: Bound | None = None
    rate: float = 1.0
    loop: bool = False
    paused: bool = False
    now: bool = False
    delay_s: float = 1.0
    remote: bool = False


def run_replay(
    paths: Sequence[Path], options: ReplayOptions, session: ZenohOptions, stopped: Callable[[], bool], console: Console
) -> int:
    """Replay until the end or `stopped`; returns the exit status.  Raises UserError, BusError and ValueError."""
    if console.is_terminal:
        logging.getLogger().handlers[:] = [terminal_handler(console)]
    plan = planned(Timeline(paths), options)
    rig = rig_of(plan)
    sys.setswitchinterval(THREAD_SWITCH_S)
    clock = RealClock()
    with ZenohBus.open(session, rig, clock, stopped) as bus, _controls(console, options.remote) as (keys, show):
        consumers = Consumers(bus, services_of(plan))
        try:
            announce_services(bus, plan, consumers, options.delay_s, stopped)
            player = Player(
                bus, clock, RealTimer(clock), plan, consumers, keys, show,
                rate=options.rate, paused=options.paused, now=options.now,
                poll_ns=REMOTE_POLL_NS if options.remote else POLL_NS,
            )  # fmt: skip
            started_s = monotonic()
            player.run(stopped)
            elapsed_s = monotonic() - started_s
            _poll_for(consumers, FLUSH_S, lambda: False)
        except DuplicateService as error:
            raise BusError(already_running(error)) from error
    if options.remote:
        write_status(player.status)  # the last status, also of a take that ended at once
        return LOSS if plan.timeline.lost or player.bad else DONE
    _print(console, status_text(player.status))
    late_ms = player.late_ns / 1e6
    _print(console, f"rig {rig}: {player.sent} messages in {elapsed_s:.1f} s, none later than {late_ms:.1f} ms")
    if player.stalls:
        _print(console, f"delayed {player.stalls} times by more than a second, then continued from there")
    lost = [*plan.timeline.lost.values(), *(f"{key}: {count} messages are not valid" for key, count in player.bad.items())]
    lost += [f"{service} {id} did not keep up" for service, id in sorted(consumers.given_up)]
    for problem in lost:
        print(f"lost: {printable(problem)}", file=sys.stderr)
    return LOSS if lost else DONE


@contextmanager
def _controls(console: Console, remote: bool) -> Iterator[tuple[CommandSource, Callable[[Status], None]]]:
    """Source of commands, and display of the status."""
    if remote:
        yield Remote(), status_lines()
        return
    with keyboard() as keys, display(console, keys=bool(keys)) as show:
        yield keys, show


def planned(timeline: Timeline, options: ReplayOptions) -> ReplayPlan:
    """Plan of a replay: keys, names and part.  Raises UserError when it is empty, and ValueError."""
    paths = ", ".join(str(part.path) for part in timeline.parts)
    available = sorted(key for key in timeline.keys if topic_at(key) is not None and not _from_animator(key))
    keys = options.selection.of(available)
    if not keys:
        raise UserError(f"{paths}: nothing to replay: no key is selected of {', '.join(available) or 'none at all'}")
    begin_ns = 0 if options.first is None else first_place(timeline, options.first)
    end_ns = timeline.duration_ns + 1
    if begin_ns is None or (begin_ns and begin_ns >= timeline.duration_ns):
        raise UserError(f"{paths}: --from {_bound_text(options.first)}: allowed: below {timeline.duration_ns / 1e9:.3f}s")
    if options.last is not None:
        following = replace(options.last, value=options.last.value + (1e-9 if options.last.seconds else 1))
        end_ns = min(end_ns, first_place(timeline, following) or end_ns)
        if end_ns <= begin_ns:
            raise UserError(f"{paths}: --until {_bound_text(options.last)}: allowed: not before --from")
    return ReplayPlan(timeline, remapped_keys(options.remapping, keys), options.remapping, begin_ns, end_ns, options.loop)


def first_place(timeline: Timeline, bound: Bound) -> int | None:
    """Place where a time or frame begins: of the first message with that frame number or a later one, None without."""
    if bound.seconds:
        return round(bound.value * 1e9)
    frames = ((placed.place_ns, frame_of(placed.recorded)) for placed in timeline.read())
    return next((place_ns for place_ns, frame in frames if frame is not None and frame >= bound.value), None)


def _bound_text(bound: Bound | None) -> str:
    return "" if bound is None else f"{bound.value:g}{'s' if bound.seconds else ''}"


def _from_animator(key: str) -> bool:
    """True for a key of the animator, which displays takes and is not part of their content."""
    service = service_at(key)
    return service is not None and service[0] == "animator"


def rig_of(plan: ReplayPlan) -> str:
    """Name of the rig that is replayed.  Raises UserError when there are several."""
    rigs = sorted({key.split("/")[1] for key in plan.keys.values()})
    if len(rigs) > 1:
        raise UserError(f"several rigs: {', '.join(rigs)}: choose one, such as --topics 'zenocap/{rigs[0]}/**'")
    return rigs[0]


def services_of(plan: ReplayPlan) -> frozenset[Name]:
    """Services whose messages are replayed (service, id), under their new names."""
    return frozenset(service for key in plan.keys.values() if (service := service_at(key)) is not None)


def announce_services(
    bus: Bus, plan: ReplayPlan, consumers: Consumers, delay_s: float, stopped: Callable[[], bool]
) -> None:
    """Announce the services of the take, and wait `delay_s` for discovery.

    Raises DuplicateService when one of them is running.
    """
    own = services_of(plan)
    bus.watch_alive()
    _poll_for(consumers, delay_s / 2, stopped)
    for service, id in sorted(own):
        bus.declare_alive(service, id)
    for key in sorted(plan.keys.values()):
        if (topic := topic_at(key)) is not None:
            bus.announce(topic, key)
    _poll_for(consumers, delay_s / 2, stopped)
    others = ", ".join(f"{service} {id}" for service, id in sorted(consumers.names)) or "no other service"
    logger.info("acting as %s; live services: %s", ", ".join(f"{service} {id}" for service, id in sorted(own)), others)


def already_running(error: DuplicateService) -> str:
    """Error text with the remedy."""
    return (
        f"{str(error).partition(';')[0]}: a replay would be a second one; stop it, leave its messages out "
        "(--topics 'viewer/**' feeds only viewers to a live integrator), or replay under another name (--rig NAME)"
    )


def _poll_for(consumers: Consumers, seconds: float, stopped: Callable[[], bool]) -> None:
    end_s = monotonic() + seconds
    while not stopped():
        consumers.poll()
        left_s = end_s - monotonic()
        if left_s <= 0:
            return
        sleep(min(left_s, 0.05))


def _print(console: Console, text: str) -> None:
    console.print(text, markup=False, highlight=False, soft_wrap=True)
