"""A replay as a process: takes in, bus open, services stood in for, play."""

import logging
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, sleep

from rich.console import Console
from rich.logging import RichHandler

from common.bus.protocol import Bus, BusError, DuplicateService
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.runtime.clock import RealClock
from common.runtime.keys import keyboard
from common.take.reading import TakeError
from common.topics import service_at, topic_at
from services.takes.replay.consumers import Consumers, Name
from services.takes.replay.display import display, words
from services.takes.replay.laps import Plan
from services.takes.replay.player import Orders, Player, Status
from services.takes.replay.remote import Remote, status_lines, write_status
from services.takes.replay.renaming import Renaming, renamed_keys
from services.takes.replay.selection import Selection
from services.takes.replay.timeline import Timeline
from services.takes.replay.waiting import RealWaiting

logger = logging.getLogger(__name__)

DONE, LOSS = 0, 3
SWITCH_S = 0.0005  # how long the thread that reads ahead may keep the one that sends waiting; Python's own is 5 ms
FLUSH_S = 0.2  # for the last messages to leave


@dataclass(frozen=True)
class Wishes:
    """What is replayed, and how.  start_s, duration_s: of the takes' time line; None to the end.  delay_s: before it.

    remote: obey the program that started it; see `services.takes.replay.remote`.
    """

    selection: Selection
    renaming: Renaming
    start_s: float = 0.0
    duration_s: float | None = None
    rate: float = 1.0
    loop: bool = False
    paused: bool = False
    now: bool = False
    delay_s: float = 1.0
    remote: bool = False


def run_replay(
    paths: Sequence[Path], wishes: Wishes, options: ZenohOptions, stopped: Callable[[], bool], console: Console
) -> int:
    """Replay until the end or `stopped`; returns the exit status.  Raises TakeError, BusError and ValueError."""
    if console.is_terminal:
        logging.getLogger().handlers[:] = [RichHandler(console=console, show_path=False)]
    plan = planned(Timeline(paths), wishes)
    rig = rig_of(plan)
    sys.setswitchinterval(SWITCH_S)
    clock = RealClock()
    with ZenohBus.open(options, rig, clock, stopped) as bus, _hands(console, wishes.remote) as (keys, show):
        consumers = Consumers(bus, services_of(plan))
        try:
            stand_in(bus, plan, consumers, wishes.delay_s, stopped)
            player = Player(
                bus, clock, RealWaiting(clock), plan, consumers, keys, show,
                rate=wishes.rate, paused=wishes.paused, now=wishes.now,
            )  # fmt: skip
            started_s = monotonic()
            player.run(stopped)
            elapsed_s = monotonic() - started_s
            _wait(consumers, FLUSH_S, lambda: False)
        except DuplicateService as error:
            raise BusError(already_running(error)) from error
    if wishes.remote:
        write_status(player.status)  # what was left out, of a take that ended before it could be said
        return LOSS if plan.timeline.lost or player.bad else DONE
    console.print(words(player.status), markup=False, highlight=False, soft_wrap=True)
    _tell(console, f"rig {rig}: {player.sent} messages in {elapsed_s:.1f} s, none later than {player.late_ns / 1e6:.1f} ms")
    if player.held_up:
        _tell(console, f"held up {player.held_up} times for more than a second, and gone on from there")
    lost = [*plan.timeline.lost.values(), *(f"{key}: {count} messages are not valid" for key, count in player.bad.items())]
    lost += [f"{service} {id} did not keep up" for service, id in sorted(consumers.given_up)]
    for problem in lost:
        print(f"lost: {problem}", file=sys.stderr)
    return LOSS if lost else DONE


@contextmanager
def _hands(console: Console, remote: bool) -> Iterator[tuple[Orders, Callable[[Status], None]]]:
    """Whom the replay obeys, and whom it tells where it is."""
    if remote:
        yield Remote(), status_lines()
        return
    with keyboard() as keys, display(console, keys=bool(keys)) as show:
        yield keys, show


def planned(timeline: Timeline, wishes: Wishes) -> Plan:
    """Which keys, under which names, from where to where.  Raises TakeError when that is nothing, and ValueError."""
    paths = ", ".join(str(part.path) for part in timeline.parts)
    ours = sorted(key for key in timeline.keys if topic_at(key) is not None and not _only_shows(key))
    keys = wishes.selection.of(ours)
    if not keys:
        raise TakeError(f"{paths}: nothing to replay: no key is selected of {', '.join(ours) or 'none at all'}")
    begin_ns = round(wishes.start_s * 1e9)
    if begin_ns and begin_ns >= timeline.duration_ns:
        raise TakeError(f"{paths}: --start-offset {wishes.start_s:g}: allowed: below {timeline.duration_ns / 1e9:.3f} s")
    end_ns = timeline.duration_ns + 1
    if wishes.duration_s is not None:
        end_ns = min(end_ns, begin_ns + round(wishes.duration_s * 1e9))
    return Plan(timeline, renamed_keys(wishes.renaming, keys), wishes.renaming, begin_ns, end_ns, wishes.loop)


def _only_shows(key: str) -> bool:
    """Whether it is the animator's: that shows a take, and is no part of what it shows."""
    service = service_at(key)
    return service is not None and service[0] == "animator"


def rig_of(plan: Plan) -> str:
    """The one rig that is replayed.  Raises TakeError when there are several."""
    rigs = sorted({key.split("/")[1] for key in plan.keys.values()})
    if len(rigs) > 1:
        raise TakeError(f"several rigs: {', '.join(rigs)}: choose one, such as --topics 'zenocap/{rigs[0]}/**'")
    return rigs[0]


def services_of(plan: Plan) -> frozenset[Name]:
    """Whose messages are replayed, by service and id, under their new names."""
    return frozenset(service for key in plan.keys.values() if (service := service_at(key)) is not None)


def stand_in(bus: Bus, plan: Plan, consumers: Consumers, delay_s: float, stopped: Callable[[], bool]) -> None:
    """Be seen as the services of the take, and give the others `delay_s` to be found and to find it.

    Raises DuplicateService when one of them is running.
    """
    own = services_of(plan)
    bus.watch_alive()
    _wait(consumers, delay_s / 2, stopped)
    for service, id in sorted(own):
        bus.declare_alive(service, id)
    for key in sorted(plan.keys.values()):
        topic = topic_at(key)
        if topic is not None:
            bus.announce(topic, key)
    _wait(consumers, delay_s / 2, stopped)
    others = ", ".join(f"{service} {id}" for service, id in sorted(consumers.names)) or "no other service"
    logger.info("standing in for %s; live: %s", ", ".join(f"{service} {id}" for service, id in sorted(own)), others)


def already_running(error: DuplicateService) -> str:
    """One line that says what to do about it."""
    return (
        f"{str(error).partition(';')[0]}: a replay would be a second one; stop it, leave its messages out "
        "(--topics 'viewer/**' feeds only viewers to a live integrator), or replay under another name (--rig NAME)"
    )


def _wait(consumers: Consumers, seconds: float, stopped: Callable[[], bool]) -> None:
    end_s = monotonic() + seconds
    while not stopped():
        consumers.hear()
        left_s = end_s - monotonic()
        if left_s <= 0:
            return
        sleep(min(left_s, 0.05))


def _tell(console: Console, text: str) -> None:
    console.print(text, markup=False, highlight=False, soft_wrap=True)
