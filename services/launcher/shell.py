"""Running a whole rig on this machine: compile, start, watch, show, stop."""

import logging
import sys
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path

from mcap.exceptions import McapError
from mcap.reader import make_reader
from rich.console import Console
from rich.live import Live
from rich.logging import RichHandler

from common.bus.protocol import Alive, Bus, Envelope
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.runtime import logs
from common.runtime.clock import RealClock
from common.runtime.rig import Rig
from common.runtime.specs import Actor
from common.topics import HEALTH, POSTURE, TRACKER_BDP, TRACKER_POSE, UNIVERSAL_BAP, UNIVERSAL_BDP
from services.launcher.board import Board, Service
from services.launcher.children import Child, Children
from services.launcher.display import dropped, plain_line, table
from services.launcher.mesh import Place, free_ports, mesh
from services.launcher.warming import compile_first

DONE, FAILED, LOSS = 0, 1, 3
ANIMATOR: Service = ("animator", "main")  # it only shows: without it the rig goes on
LOOK_S, REFRESH_S, LINE_S = 0.1, 0.25, 1.0


def run_rig(
    rig: Rig,
    rig_argument: Path,
    options: ZenohOptions,
    take: Path | None,
    seconds: float | None,
    stopped: Callable[[], bool],
    console: Console,
    page: bool = True,
) -> int:
    """Run every service of a rig as a process of its own; returns the exit status.

    take: the log, None for none.  seconds: when to end, counted from the start of the processes.  page: with the animator.
    Raises BusError.
    """
    if console.is_terminal:
        logging.getLogger().handlers[:] = [RichHandler(console=console, show_path=False)]
    else:
        logs.configure("zenocap")
    for note in rig.notes:
        console.print(f"note: {note}", markup=False, highlight=False)
    has_actor = any(isinstance(viewer.source, Actor) for viewer in rig.viewers)
    if not compile_first(has_actor, rig.tracker is not None, rig.recognizer is not None, stopped, console):
        return DONE if stopped() else FAILED
    optional = {"tracker": rig.tracker, "recognizer": rig.recognizer}
    beside: list[Service] = [(name, "main") for name, spec in optional.items() if spec is not None]
    viewers: list[Service] = [("viewer", viewer.id) for viewer in rig.viewers]
    animator: list[Service] = [ANIMATOR] if page else []
    services: list[Service] = [("integrator", "main"), *beside, *viewers, *animator]
    clock = RealClock()
    places = _places(options, len(services) + 1)
    commands = []
    for (name, id), place in zip(services, places, strict=False):
        arguments = [sys.executable, "-P", "-m", "services.cli", name, str(rig_argument), "--with-parent"]
        own = {"viewer": ["--id", id], "integrator": _log_arguments(take), "animator": _take_arguments(take)}
        arguments += own.get(name, [])
        commands.append((f"{name} {id}" if name == "viewer" else name, [*arguments, *_zenoh_arguments(place)]))
    children = Children(commands, time.monotonic)
    with ZenohBus.open(places[-1], rig.name, clock, stopped) as bus:
        shown = [*viewers, *beside, services[0], *animator]
        watch = Watch(children, bus, shown, take, console)
        try:
            children.start()
            watch.run(seconds, stopped)
        finally:
            console.print("stopping ...", markup=False)
            children.stop(lambda name: name != "integrator")
            children.stop()
            watch.tell()
    return watch.summary()


class Watch:
    """The parent's view of its children: reads the bus, shows the board, and tells what happened."""

    def __init__(self, children: Children, bus: Bus, services: list[Service], take: Path | None, console: Console) -> None:
        self._children, self._bus, self._services = children, bus, services
        self._take, self._console = take, console
        self._board = Board()
        self._first_s: float | None = None
        for topic in (HEALTH, UNIVERSAL_BDP, UNIVERSAL_BAP, TRACKER_BDP, TRACKER_POSE, POSTURE):
            bus.subscribe(topic)
        bus.watch_alive()

    def run(self, seconds: float | None, stopped: Callable[[], bool]) -> None:
        """Until stopped, the time is over, every viewer has finished, or one has failed for good."""
        started_s = time.monotonic()
        line_s = started_s + LINE_S
        with self._display() as live:
            while not stopped() and not self._over():
                now_s = time.monotonic()
                if seconds is not None and now_s - started_s >= seconds:
                    return
                self._children.poll()
                self.tell()
                self._listen(now_s - started_s)
                if live is not None:
                    live.update(table(self._board, self._services, now_s - started_s, str(self._take or "none")))
                elif now_s >= line_s:
                    line_s += LINE_S
                    self._print(plain_line(self._board, self._services, now_s - started_s))

    def tell(self) -> None:
        """Print what the children wrote."""
        for line in self._children.lines():
            if self._console.is_terminal:
                self._print(line)
            else:
                print(line, file=sys.stderr, flush=True)

    def summary(self) -> int:
        """Say how it ended; the exit status."""
        failed = self._needed()
        integrator = next(child for child in self._children.all if child.name == "integrator")
        lost = max(0, sum(health.counts.get("log_lost", 0) for health in self._board.health.values()))
        if self._first_s is not None:
            self._print(
                f"first pose {self._first_s:.1f} s after the start; {self._board.poses} poses, "
                f"{self._board.whole} of them by all viewers; frames dropped: {self._dropped()}"
            )
        else:
            self._print("no pose: the body is measured when all viewers see the initial posture")
        if self._board.postures:
            told = ", ".join(f"{label} {count}" for label, count in self._board.postures.items())
            self._print(f"postures: {told}")
        if self._take is not None:
            takes = sorted(self._take.parent.glob(f"{self._take.stem}*.mcap"))
            for path in takes:
                self._print(f"take: {path}: {messages_in(path)} messages, {lost} lost")
            if takes and self._board.poses:
                self._print(f"look into it: zenocap info {takes[0]}")
                self._print(f"joint centres: zenocap export {takes[0]} --to trc -o {self._take.stem}.trc")
        broken = [child for child in failed if not (child is integrator and child.status == LOSS)]
        for child in broken:
            self._print(f"error: {child.name} failed; what it said stands above")
        stopped = any(health.counts.get("log_stopped", 0) for health in self._board.health.values())
        return FAILED if broken else LOSS if failed or lost or stopped else DONE

    def _over(self) -> bool:
        viewers = [child for child in self._children.all if child.name.startswith("viewer")]
        return bool(self._needed()) or all(_finished(child) for child in viewers)

    def _needed(self) -> list[Child]:
        """Those that failed for good, and without which the rig cannot go on."""
        return [child for child in self._children.given_up if child.name != ANIMATOR[0]]

    def _listen(self, elapsed_s: float) -> None:
        """Everything that has come, or a short wait for it."""
        until_s = time.monotonic() + (REFRESH_S if self._console.is_terminal else LOOK_S)
        while (left_s := until_s - time.monotonic()) > 0:
            event = self._bus.receive(left_s)
            if isinstance(event, Envelope | Alive):
                self._board = self._board.heard(event)
                if self._board.pose is not None and self._first_s is None:
                    self._first_s = elapsed_s

    def _dropped(self) -> int:
        return sum(dropped(health) for health in self._board.health.values())

    def _display(self) -> AbstractContextManager[Live | None]:
        if not self._console.is_terminal:
            return nullcontext(None)
        return Live(console=self._console, refresh_per_second=4, transient=False)

    def _print(self, text: str) -> None:
        self._console.print(text, markup=False, highlight=False, soft_wrap=True)
        self._console.file.flush()


def messages_in(path: Path) -> int:
    """How many messages a finished take has; 0 for one that was cut."""
    try:
        with path.open("rb") as file:
            summary = make_reader(file).get_summary()
    except (McapError, OSError):
        return 0
    return summary.statistics.message_count if summary and summary.statistics else 0


def _finished(child: Child) -> bool:
    return child.status == 0


def _places(options: ZenohOptions, count: int) -> list[ZenohOptions]:
    """Each member's way to the others, the integrator's first, this process's last.

    A mesh of peers over loopback; the rig's own endpoints come on top, so that other machines can join.  Clients leave
    the connection of all to their router.
    """
    if options.mode == "client":
        return [options] * count
    places = mesh(free_ports(count), "tls" if options.security else "tcp")
    members = [_member(options, place) for place in places]
    members[0] = replace(members[0], listen=(*members[0].listen, *options.listen))
    return members


def _member(options: ZenohOptions, place: Place) -> ZenohOptions:
    return replace(
        options,
        mode="peer",
        listen=(place.listen,),
        connect=(*place.connect, *options.connect),
        multicast_scouting=False,
    )


def _zenoh_arguments(options: ZenohOptions) -> list[str]:
    arguments = ["--mode", options.mode] if options.mode else []
    for name, endpoints in (("--connect", options.connect), ("--listen", options.listen)):
        for endpoint in endpoints:
            arguments += [name, endpoint]
    if options.config_file:
        arguments += ["--config", str(options.config_file)]
    return arguments if options.multicast_scouting else [*arguments, "--no-multicast-scouting"]


def _take_arguments(take: Path | None) -> list[str]:
    return [] if take is None else ["--recordings", str(take.parent)]


def _log_arguments(take: Path | None) -> list[str]:
    return ["--no-log"] if take is None else ["--output", str(take)]
