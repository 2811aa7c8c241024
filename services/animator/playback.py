"""Takes on the page: a replay in a process of its own, on a network of its own, so that what is live never notices.

One thread works through the orders.  The replay talks over loopback to a bus that nobody else is on; what it says goes
through the same step as what is live, to the pages that watch the take.
"""

import logging
import queue
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import msgspec

from common.bus.protocol import Alive, BusError, Envelope, Tick
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.runtime.clock import Clock
from common.topics import Topic
from services.animator.page import wire
from services.animator.page.display import Shown, show
from services.animator.page.hub import Hub, Piece
from services.animator.states import Setup
from services.animator.step import initial_state, step

logger = logging.getLogger(__name__)

RIG = "take"  # under which a take is replayed
MOST_TAKES = 200
MOST_ORDERS = 64  # that wait
TICK_NS, WAIT_S = 200_000_000, 0.02
PATIENCE_S = 3.0
ERROR = "error: "  # begins what a command says before it fails
DELAY_S = 0.3  # for the replay to find this bus


@dataclass(frozen=True)
class Stop:
    """Of the playback; for good when the animator ends."""

    for_good: bool = False


Order = wire.Play | wire.Control | Stop


class Playback:
    """folder: where the takes are.  topics: what is shown of one."""

    def __init__(self, folder: Path, hub: Hub, clock: Clock, topics: tuple[Topic, ...]) -> None:
        self._folder, self._hub, self._clock, self._topics = folder, hub, clock, topics
        self._orders: queue.SimpleQueue[Order] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._work, name="playback", daemon=True)
        self._thread.start()

    def takes(self) -> wire.Takes:
        """Newest first."""
        try:
            found = [(path.stat().st_mtime, path.name, path.stat().st_size) for path in self._folder.glob("*.mcap")]
        except OSError as error:
            logger.warning("%s: its takes cannot be listed: %s", self._folder, error.strerror or error)
            found = []
        return wire.Takes([(name, size / 1e6) for _, name, size in sorted(found, reverse=True)[:MOST_TAKES]])

    def order(self, order: Order) -> None:
        """From any thread; never waits.  Beyond MOST_ORDERS they are dropped: nobody presses so fast."""
        if self._orders.qsize() < MOST_ORDERS:
            self._orders.put(order)

    def close(self) -> None:
        self._orders.put(Stop(for_good=True))
        self._thread.join(2 * PATIENCE_S)

    def _work(self) -> None:
        order: Order | None = None
        while True:
            order = order or self._orders.get()
            match order:
                case wire.Play(take=take):
                    order = self._play(take)
                case Stop(for_good=True):
                    return
                case _:
                    order = None

    def _tell(self, player: wire.Player) -> None:
        self._hub.publish(None, [Piece("player", wire.encode(player))])

    def _play(self, take: str) -> Order | None:
        """Until the take ends or another order comes, which is returned."""
        path = self._folder / take
        if not path.is_file():
            self._tell(wire.Player("", problem=f"{take}: no such take"))
            return None
        port = _free_port()
        options = ZenohOptions(mode="peer", listen=(f"tcp/127.0.0.1:{port}",), multicast_scouting=False)
        self._hub.forget("take")
        try:
            with ZenohBus.open(options, RIG, self._clock) as bus:
                for topic in self._topics:
                    bus.subscribe(topic)
                bus.watch_alive()
                with _Replay(path, port) as replay:
                    self._tell(wire.Player(take))
                    order = self._watch(take, bus, replay)
            problem = "" if order else replay.problem()
        except (BusError, OSError) as error:
            order, problem = None, str(error)
        self._tell(wire.Player("", problem=problem and f"{take}: {problem}"))
        return order

    def _watch(self, take: str, bus: ZenohBus, replay: "_Replay") -> Order | None:
        setup = Setup()
        state, shown = initial_state(setup), Shown()
        tick_ns, last = 0, None
        while replay.runs:
            event = bus.receive(WAIT_S)
            while event is not None:
                if isinstance(event, Envelope | Alive):
                    state, _ = step(setup, state, event)
                event = bus.receive(0.0)
            if self._clock.elapsed_ns() >= tick_ns:
                tick_ns = self._clock.elapsed_ns() + TICK_NS
                state, _ = step(setup, state, Tick(self._clock.now_ns()))
                if replay.status is not None and replay.status != last:
                    last = replay.status
                    self._tell(wire.Player(take, last.place_s, last.duration_s, last.rate, last.paused, last.problem()))
            shown, pieces = show(shown, state, self._hub.pages)
            if pieces:
                self._hub.publish("take", pieces)
            while not self._orders.empty():
                order = self._orders.get()
                if not isinstance(order, wire.Control) or order.stop:
                    return order if not isinstance(order, wire.Control) else Stop()
                replay.obey(order)
        return None


class Place(msgspec.Struct, frozen=True):
    """As the replay says it on a line of its own."""

    place_s: float
    duration_s: float
    rate: float
    paused: bool
    bad: int = 0

    def problem(self) -> str:
        return f"{self.bad} messages cannot be read by this version" if self.bad else ""


class _Replay:
    """The process."""

    def __init__(self, path: Path, port: int) -> None:
        arguments = [
            sys.executable, "-P", "-m", "services.cli", "replay", str(path), "--rig", RIG, "--remote", "--loop",
            "--delay", str(DELAY_S), "--mode", "peer", "--connect", f"tcp/127.0.0.1:{port}", "--no-multicast-scouting",
        ]  # fmt: skip
        self.status: Place | None = None
        self._said = ""
        self._process = subprocess.Popen(
            arguments, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, errors="replace",
            start_new_session=True,
        )  # fmt: skip
        self._readers = [self._read(self._process.stdout, self._hear), self._read(self._process.stderr, self._complain)]

    @property
    def runs(self) -> bool:
        return self._process.poll() is None

    def obey(self, control: wire.Control) -> None:
        order = {"paused": control.paused, "place_s": control.place_s, "rate": control.rate}
        assert self._process.stdin is not None  # it is a pipe
        try:
            self._process.stdin.write(msgspec.json.encode(order).decode() + "\n")
            self._process.stdin.flush()
        except OSError:
            logger.debug("the replay has ended")

    def problem(self) -> str:
        """Why it ended; empty when nothing went wrong.  After its end."""
        if self._process.returncode in (0, -signal.SIGTERM):
            return ""
        left_out = self.status.problem() if self.status else ""
        return self._said or left_out or f"the replay ended with status {self._process.returncode}"

    def __enter__(self) -> "_Replay":
        return self

    def __exit__(self, *_: object) -> None:
        if self.runs:
            self._process.terminate()
            try:
                self._process.wait(PATIENCE_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        for reader in self._readers:
            reader.join(1.0)
        for stream in (self._process.stdin, self._process.stdout, self._process.stderr):
            if stream is not None:
                stream.close()

    def _read(self, stream: IO[str] | None, heard: Callable[[str], None]) -> threading.Thread:
        assert stream is not None  # it is a pipe

        def read() -> None:
            for line in stream:
                heard(line)

        thread = threading.Thread(target=read, name="replay", daemon=True)
        thread.start()
        return thread

    def _hear(self, line: str) -> None:
        try:
            self.status = msgspec.json.decode(line, type=Place)
        except msgspec.MsgspecError:
            logger.debug("the replay says %s", line.rstrip())

    def _complain(self, line: str) -> None:
        if line.startswith(ERROR):
            self._said = line.strip().removeprefix(ERROR)
        else:
            logger.debug("the replay says %s", line.rstrip())


def _free_port() -> int:
    """A TCP port of loopback that nobody listens on now."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])
