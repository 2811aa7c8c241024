"""Run a whole rig on this machine: compile, start, supervise, display, stop."""

import logging
import re
import sys
import time
from collections.abc import Callable, Collection
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, ExitStack, nullcontext, suppress
from dataclasses import replace
from itertools import repeat
from pathlib import Path

from rich.console import Console
from rich.live import Live

from zenocap.common.bus.protocol import Alive, Bus, BusError, Envelope, Received
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_film import FilmSession
from zenocap.common.bus.zenoh_session import ZenohOptions, free_ports
from zenocap.common.messages import ENDED
from zenocap.common.observe.account import Account
from zenocap.common.observe.losses import SUMMED
from zenocap.common.observe.view import RigView
from zenocap.common.rig.hosted import assignment, hosted_cameras
from zenocap.common.rig.methods import method_of
from zenocap.common.rig.rig import Rig
from zenocap.common.rig.services import MAIN, SERVICES, TIMEKEEPER, ServiceKey, services_of, title, warmup_parts
from zenocap.common.runtime import logs
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.foreign_text import MAX_LINE, printable
from zenocap.common.topics import HEALTH, POSTURE, TRACKER_BDP, TRACKER_POSE, UNIVERSAL_BAP, UNIVERSAL_BDP, Topic
from zenocap.tools.operate.warmup.processes import compile_parts
from zenocap.tools.record.launcher.child_processes import ChildProcess, ChildProcesses, allow_files
from zenocap.tools.record.launcher.display import plain_line, table
from zenocap.tools.record.launcher.fork_server import fork_server
from zenocap.tools.record.launcher.frame_statement import FrameStatement, frames_of
from zenocap.tools.record.launcher.hosted_viewers import HostedViewers, secured_advice
from zenocap.tools.record.launcher.peer_mesh import peer_mesh
from zenocap.tools.record.launcher.rig_status import RigStatus
from zenocap.tools.record.launcher.run_takes import Unresumed, new_takes
from zenocap.tools.record.launcher.statement import statement
from zenocap.tools.service_arguments import arguments_of, words

DONE, FAILED, LOSS, INTERRUPTED = 0, 1, 3, 130  # the last: of Ctrl-C before the rig has started, as of other programs
REQUIRED = {kind.name for kind in SERVICES if kind.required}
POLL_S, REFRESH_S, LINE_S = 0.1, 0.25, 1.0
REST_S = 1.0  # to receive what was sent before the end; chosen by hand
LARGE_BYTES = 100_000_000  # of a take, the reading of which is said; chosen by hand


def run_rig(
    rig: Rig,
    rig_argument: Path,
    options: ZenohOptions,
    folder: Path,
    take: Path | None,
    seconds: float | None,
    stopped: Callable[[], bool],
    console: Console,
    page: bool = True,
    port: int | None = None,
) -> int:
    """Run every service of a rig as a separate process; return the exit status.

    folder: of the takes that the page starts.  take: the one that begins with the rig; None: none does.  seconds: run time
    from the start of the processes.  page: whether to run the animator.  port: of the page, None for the rig's own.
    Raises UserError.
    """
    allow_files()
    if console.is_terminal:
        logging.getLogger().handlers[:] = [logs.terminal_handler(console)]
    else:
        logs.configure("zenocap")
    for note in rig.notes:
        console.print(f"note: {note}", markup=False, highlight=False)
    if not compile_parts(warmup_parts(rig), stopped, console):
        return INTERRUPTED if stopped() else FAILED
    services = [service for service in services_of(rig) if page or service[0] != "animator"]
    elsewhere = hosted_cameras(rig)
    away = {("viewer", one.viewer) for one in elsewhere}
    # The integrator first, others in order.
    starting = sorted((one for one in services if one not in away), key=lambda service: service[0] != TIMEKEEPER)
    clock = RealClock()
    places = places_of(options, len(starting) + 2, named_ports(rig, options, port), reachable=bool(elsewhere))
    commands = []
    for (name, id), place in zip(starting, places, strict=False):
        own = {"integrator": log_arguments(folder, take), "animator": _page_arguments(folder, port)}.get(name, [])
        commands.append((title((name, id)), words((name, id), rig_argument, arguments_of(place), *own)))
    names = {name for name, _ in starting}
    # Loaded once: two viewers would take as long at the start, and one that is started again would load them again.
    parts = ("silhouettes",) if "viewer" in names else ()
    with fork_server(names, parts, stopped) as start, ExitStack() as session, ExitStack() as stack:
        try:
            bus = session.enter_context(ZenohBus.open(places[-1], rig.name, clock, stopped, services))
        except BusError:
            if stopped():
                return INTERRUPTED
            raise
        finishing = [title(("viewer", viewer.id)) for viewer in rig.viewers if viewer.source.finishes]
        children = ChildProcesses(commands, time.monotonic, start, finishing)
        hosted = None
        if elsewhere and options.security is not None:
            for line in secured_advice(elsewhere, rig_argument):
                console.print(line, markup=False, highlight=False, soft_wrap=True)
        elif elsewhere:
            hosted = HostedViewers(
                FilmSession.open(places[-2], stopped), elsewhere, lambda id: assignment(rig, id, clock.now_ns())
            )
            stack.callback(hosted.close)
        supervisor = Supervisor(children, bus, services, folder, take, console, hosted, method_of(rig.method).sends[0])
        try:
            children.start()
            if hosted is not None:
                hosted.start()
            supervisor.run(seconds, stopped)
        finally:
            console.print("stopping ...", markup=False)
            end(children, stack.close)
            supervisor.print_output()
            supervisor.receive_rest()
    return supervisor.summary(interrupted=stopped())


def end(children: ChildProcesses, give_back: Callable[[], object]) -> None:
    """End all services but the integrator at once, those of other machines by `give_back`, and then the integrator."""
    with ThreadPoolExecutor(1) as pool:
        given_back = pool.submit(give_back)
        children.stop(lambda name: name != TIMEKEEPER)
    children.stop()
    given_back.result()


class Supervisor:
    """Supervision of the children: reads the bus, displays the status, and prints the result."""

    def __init__(
        self,
        children: ChildProcesses,
        bus: Bus,
        services: list[ServiceKey],
        folder: Path,
        take: Path | None,
        console: Console,
        hosted: HostedViewers | None,
        frames: Topic,
    ) -> None:
        """folder, take: see `run_rig`.  hosted: viewers that other machines run.

        frames: topic that a viewer sends with every frame.
        """
        self._hosted = hosted
        self._children, self._bus, self._services = children, bus, services
        self._take, self._console = take, console
        self._status = RigStatus(RigView(bus.rig, tuple(services)))
        self._reports, self._unresumed = Account(own=services), Unresumed()
        self._frames = frames
        self._folder, self._takes_before = folder, set(folder.glob("*.mcap"))
        self._first_s: float | None = None
        bus.subscribe(HEALTH, every=True)
        for topic in (UNIVERSAL_BDP, UNIVERSAL_BAP, TRACKER_BDP, TRACKER_POSE, POSTURE):
            bus.subscribe(topic)
        bus.watch_alive()

    def run(self, seconds: float | None, stopped: Callable[[], bool]) -> None:
        """Run until stopped, the time is over, every viewer has finished, or a required service is not restarted."""
        started_s = time.monotonic()
        with self._display() as live:
            period_s = LINE_S if live is None else REFRESH_S
            shown_s = started_s + period_s
            while not stopped() and not self._is_over():
                now_s = time.monotonic()
                if seconds is not None and now_s - started_s >= seconds:
                    return
                self._children.poll()
                self.print_output()
                self._receive(now_s - started_s)
                if now_s < shown_s:
                    continue
                shown_s = now_s + period_s - (now_s - shown_s) % period_s  # after a pause of this process once
                view = self._status.services
                running = [key for key, health in view.health.items() if not health.counts.get(ENDED)]
                self._children.end_silent({title(key): view.services[key].health_ns / 1e9 for key in running}, period_s)
                if live is not None:
                    take = str(self._take or "none")
                    live.update(table(self._status, self._services, now_s - started_s, take, self._console.width))
                else:
                    self._print(plain_line(self._status, self._services, now_s - started_s))

    def print_output(self) -> None:
        """Print what the children wrote, and the state of viewers on other machines."""
        for line in self._hosted.news() if self._hosted is not None else ():
            self._print(printable(line, MAX_LINE))
        for line in map(printable, self._children.lines(), repeat(MAX_LINE)):
            if self._console.is_terminal:
                self._print(line)
            else:
                print(line, file=sys.stderr, flush=True)

    def summary(self, *, interrupted: bool = False) -> int:
        """Print the result; return the exit status.  interrupted: whether the user has ended the run."""
        failed = self._failed_services()
        if self._first_s is not None:
            own = [one for key, one in self._status.services.services.items() if key in self._services]
            lost = sum(one.total(name) for one in own for name in SUMMED)
            self._print(
                f"first pose {self._first_s:.1f} s after the start; {self._status.poses} poses, "
                f"{self._status.complete} of them by all viewers; lost frames, messages and steps: {lost}"
            )
        else:
            self._print("no pose: the body is measured when all viewers see a T-pose")
        if self._status.postures:
            counts = ", ".join(f"{label} {count}" for label, count in self._status.postures.items())
            self._print(f"postures: {counts}")
        frames = frames_of(self._status.services, self._reports, self._services, self._frames)
        for line in frames.text():
            self._print(line)
        incomplete = self._print_takes(frames)
        broken = [child for child in failed if not (child is self._integrator and child.status == LOSS)]
        for child in broken:
            self._print(f"error: {child.name} failed; see its output above")
        never_ran = self._hosted.never_ran if self._hosted is not None else []
        for text in never_ran:
            self._print(f"error: {printable(text, MAX_LINE)}")
        if broken or never_ran:
            return FAILED
        return LOSS if failed or incomplete else INTERRUPTED if interrupted and not self._has_begun else DONE

    def receive_rest(self) -> None:
        """Handle what the services published until they ended, such as the integrator's last health.

        For REST_S at most: another program may publish on the rig without end.
        """
        end_s = time.monotonic() + REST_S
        while (left_s := end_s - time.monotonic()) > 0:
            if (event := self._bus.receive(min(POLL_S, left_s))) is not None:
                self._handle(event)
            elif not self._bus.counters.queued:  # else these were invalid ones
                return

    @property
    def _integrator(self) -> ChildProcess:
        return next(child for child in self._children.all if child.name == TIMEKEEPER)

    @property
    def _has_begun(self) -> bool:
        """Whether the integrator, which begins the take, was there."""
        return (TIMEKEEPER, MAIN) in self._status.services.services

    def _print_takes(self, frames: FrameStatement) -> bool:
        """Print the takes of this run and what became of all messages.

        Returns whether some of them are lost, or some of them or of the frames not counted.
        """
        takes, unreadable, of_commands = new_takes(
            self._folder, self._takes_before, self._bus.rig, self._reports, self._say_reading
        )
        for one in of_commands:
            self._print(f"take: {one.path}: of `zenocap {one.command}`, none of this run")
        integrator = self._status.services.services.get((TIMEKEEPER, MAIN))
        asked = integrator is not None and any(integrator.total(f"log_{name}") for name in ("messages", "lost", "removed"))
        if self._take is None and not (takes or asked):  # a file of others is none of this run
            return self._has_begun and not frames.complete
        if not (takes or unreadable or self._has_begun):
            self._print("take: none, the end came before its beginning")
            return False
        whole = integrator is None or not (integrator.total("log_stopped") or integrator.total("log_removed"))
        whole = whole and self._integrator.status is not None  # else it had ended before the others were stopped
        whole = whole and bool(takes) and not unreadable and takes[-1].complete
        found = statement(takes, self._reports, self._services, whole=whole, unresumed=self._unresumed.accounts)
        for line in unreadable:
            self._print(f"take: {printable(line)}")
        for line in found.take_text():
            self._print(line)
        for line in found.text():
            self._print(line)
        if takes and self._status.poses:
            longest = max(takes, key=lambda take: take.messages).path
            self._print(f"content: zenocap info {longest}")
            self._print(f"joint centres: zenocap export {longest} --to trc -o {longest.stem}.trc")
        return not (found.complete and frames.complete and whole and all(one.complete for one in takes))

    def _say_reading(self, path: Path) -> None:
        with suppress(OSError):  # it was removed meanwhile
            if (size := path.stat().st_size) >= LARGE_BYTES:
                self._print(f"take: {path} was not closed, or is damaged: reading its {size / 1e9:.1f} GB ...")

    def _handle(self, event: Received) -> None:
        if isinstance(event, Envelope | Alive):
            self._status = self._status.updated(event, time.monotonic_ns())
            self._reports.add(event)
            if self._take is None:  # else the next integrator begins another one at once
                self._unresumed.note(event, self._reports)

    def _is_over(self) -> bool:
        viewers = {title(service) for service in self._services if service[0] == "viewer"}
        finished = {child.name for child in self._children.all if child.status == 0}
        return bool(self._failed_services()) or viewers <= finished

    def _failed_services(self) -> list[ChildProcess]:
        """Required services that failed and are not restarted."""
        names = [title(service) for service in self._services if service[0] in REQUIRED]
        return [child for child in self._children.given_up if child.name in names]

    def _receive(self, elapsed_s: float) -> None:
        """Handle all received events, after a short wait for the first."""
        until_s = time.monotonic() + POLL_S
        while (left_s := until_s - time.monotonic()) > 0:
            if (event := self._bus.receive(left_s)) is not None:
                self._handle(event)
                if self._status.pose is not None and self._first_s is None:
                    self._first_s = elapsed_s

    def _display(self) -> AbstractContextManager[Live | None]:
        if not self._console.is_terminal:
            return nullcontext(None)
        return Live(console=self._console, refresh_per_second=4, transient=False)

    def _print(self, text: str) -> None:
        self._console.print(text, markup=False, highlight=False, soft_wrap=True)
        self._console.file.flush()


def named_ports(rig: Rig, options: ZenohOptions, page: int | None) -> set[int]:
    """Ports that the rig file or the command line names: of the page, the outputs and Zenoh.  page: as in `run_rig`."""
    outputs = {getattr(output, "port", 0) for output in rig.animator.outputs.values()}
    listen = [re.search(r":(\d+)(?:[?#]|$)", endpoint) for endpoint in options.listen]  # such as tcp/0.0.0.0:7447
    return {rig.animator.page.port if page is None else page, *outputs, *(int(one[1]) for one in listen if one)}


def places_of(options: ZenohOptions, count: int, named: Collection[int], *, reachable: bool = False) -> list[ZenohOptions]:
    """Connection options of each member, the integrator's first, this process's two last.  named: see `free_ports`.

    Peers form a mesh over loopback, in addition to the rig's own endpoints, so that other machines can join.  Clients
    connect only to their router.  reachable: whether peers find those of other machines by multicast, where it is allowed.
    """
    if options.mode == "client":
        return [options] * count
    peer = replace(options, mode="peer", multicast_scouting=bool(reachable and options.multicast_scouting))
    members = [
        replace(peer, listen=(place.listen,), connect=(*place.connect, *options.connect))
        for place in peer_mesh(free_ports(count, named), "tls" if options.security else "tcp")
    ]
    members[0] = replace(members[0], listen=(*members[0].listen, *options.listen))
    return members


def _page_arguments(folder: Path, port: int | None) -> list[str]:
    recordings = ["--recordings", str(folder)]
    return recordings if port is None else [*recordings, "--port", str(port)]


def log_arguments(folder: Path, take: Path | None) -> list[str]:
    """Arguments of the integrator; see `run_rig`."""
    return ["--recordings", str(folder), *(("--no-log",) if take is None else ("--output", str(take)))]
