"""Zenoh sessions: options, configuration, free ports."""

import errno
import json
import logging
import math
import os
import socket
import threading
import time
from collections.abc import Callable, Collection, Iterable
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from random import SystemRandom
from typing import ClassVar, Literal, Protocol

import zenoh

from zenocap.common.bus.protocol import BusError
from zenocap.common.bus.security import Security, secured

logger = logging.getLogger(__name__)

Mode = Literal["peer", "client", "router"]
HOST = "127.0.0.1"
PORTS = range(20_000, 32_768)  # below those that systems give to connections and to programs that ask for any port
REACH_S = 10.0  # without any participant, then logged: the parts of a rig start at different times; by hand
REACH_PERIOD_S = 0.5  # between two looks, chosen by hand
CLOSE_S = 1.0  # to leave a network; a router that hangs keeps Zenoh for 7 s; chosen by hand

# Chosen for a rig: a frozen machine is detected after 2 s, a restarted router found within 0.5 s, and a service may
# start before its router.  No message is near 8 MiB.  A lost recovery of LATCHED state delays it by at most 2 s.
# The messages of one frame set are sent in a burst.  With Zenoh's default of 2 places in the queue, some of a dozen are
# dropped whenever its thread is late by a millisecond (measured: 10 of 4800; none with 4 and more places).
# Shared memory is off because a killed process leaves its files behind, and silhouettes gain nothing from it.
TUNED = {
    "transport/link/tx/lease": "2000",
    "transport/link/rx/max_message_size": str(8 << 20),
    "transport/link/tx/queue/size/data": "16",
    "transport/link/tx/queue/congestion_control/drop/max_wait_before_drop_fragments": "5000",
    "transport/shared_memory/enabled": "false",
    "queries_default_timeout": "2000",
    "connect/retry": '{"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 1.5}',
    "connect/timeout_ms": "-1",
    "connect/exit_on_failure": "false",
}

# Zenoh has one network thread by default.  Where peers come and go, it can wait for a lock whose owner waits for that
# thread (zenoh issue 2581): no session of the process connects any more, without an error.  Not reproduced here.
os.environ.setdefault("ZENOH_RUNTIME", "(net: (worker_threads: 4))")


@dataclass(frozen=True)
class ZenohOptions:
    """Zenoh's own command-line options; None or empty keeps the value of the file, or Zenoh's default.

    connect, listen: endpoints such as "tcp/192.168.1.2:7447".  config_file: JSON5; it overrides TUNED, and security
    overrides it.
    """

    mode: Mode | None = None
    connect: tuple[str, ...] = ()
    listen: tuple[str, ...] = ()
    config_file: Path | None = None
    multicast_scouting: bool | None = None
    security: Security | None = None


def configuration(options: ZenohOptions) -> zenoh.Config:
    """Zenoh configuration for `options`.  Raises BusError for a file or endpoint that Zenoh rejects."""
    default, config = zenoh.Config(), _from_file(options.config_file) if options.config_file else zenoh.Config()
    for key, value in TUNED.items():
        if config.get_json(key) == default.get_json(key):
            _insert(config, key, value)
    if options.mode:
        _insert(config, "mode", f'"{options.mode}"')
    for key, endpoints in (("connect/endpoints", options.connect), ("listen/endpoints", options.listen)):
        for endpoint in endpoints:
            _check_endpoint(key, endpoint)
        if endpoints:
            _insert(config, key, "[" + ", ".join(f'"{endpoint}"' for endpoint in endpoints) + "]")
    if options.multicast_scouting is not None:
        _insert(config, "scouting/multicast/enabled", "true" if options.multicast_scouting else "false")
    if options.security:
        mode = str(json.loads(config.get_json("mode")))
        for key, value in secured(options.security, mode, options.connect, options.listen).items():
            _insert(config, key, value)
    return config


def open_session(options: ZenohOptions, stopped: Callable[[], bool] = lambda: False) -> zenoh.Session:
    """An open session.  A client waits for its router until `stopped`; other modes connect in the background.

    Raises BusError when the configuration is rejected, an address cannot be listened on, or `stopped` is true first.
    """
    where = ", ".join(options.connect) or "any address"
    opening = _Opening.of(options)
    warned, started_s = False, time.monotonic()
    try:
        while not opening.ended(0.05):
            if stopped():
                raise BusError(f"stopped while waiting for a Zenoh router at {where}")
            if not warned and time.monotonic() - started_s > 2.0:
                warned = True
                logger.warning("waiting for a Zenoh router at %s", where)
    except BaseException:
        opening.leave()
        raise
    if isinstance(opening.outcome, BaseException):
        listening = f", listen {', '.join(options.listen)}" if options.listen else ""
        raise BusError(f"Zenoh does not open (connect {where}{listening}): {_reason(opening.outcome)}")
    return opening.outcome


class _Opening:
    """`zenoh.open` in a thread, because a signal cannot end it while a client waits for its router.

    One that is left waits on, and is what the next session with the same options waits for; a session that it
    opens before then is closed.  outcome: once it has ended.
    """

    _left: ClassVar[list["_Opening"]] = []
    _lock: ClassVar[threading.Lock] = threading.Lock()

    outcome: zenoh.Session | BaseException

    def __init__(self, options: ZenohOptions, config: zenoh.Config) -> None:
        self._config, self._ended = config, threading.Event()
        self._of = options, str(config)
        threading.Thread(target=self._run, name="zenoh-open", daemon=True).start()

    @classmethod
    def of(cls, options: ZenohOptions) -> "_Opening":
        """The one that was left with these options and files, or else a new one.  Raises BusError."""
        config = configuration(options)
        with cls._lock:
            for one in cls._left:
                if one._of == (options, str(config)):
                    cls._left.remove(one)
                    return one
        return cls(options, config)

    def ended(self, wait_s: float) -> bool:
        """Whether it has ended, after at most this time."""
        return self._ended.wait(wait_s)

    def leave(self) -> None:
        """Wait for it no longer."""
        with self._lock:
            if not self._ended.is_set():
                self._left.append(self)
                return
        self._close()

    def _run(self) -> None:
        try:
            self.outcome = zenoh.open(self._config)
        except BaseException as error:  # a panic in Rust is no Exception
            self.outcome = error
        with self._lock:
            self._ended.set()
            if self not in self._left:
                return
            self._left.remove(self)
        self._close()

    def _close(self) -> None:
        if not isinstance(self.outcome, BaseException):
            close_session(self.outcome)


class Reach:
    """Logs that no address of a peer has been reached, and when one is.

    Zenoh connects in the background and logs nothing: a service with a false address runs alone.
    """

    def __init__(self, session: zenoh.Session, connect: Collection[str]) -> None:
        """connect: the addresses; with none, nothing is logged."""
        self._info, self._where = session.info, ", ".join(connect)
        self._started_s = time.monotonic()
        self._due_s = self._started_s + REACH_S if connect else math.inf
        self._logged = False

    def check(self) -> None:
        """Look if it is time; called by the thread of the bus, several times a second."""
        now_s = time.monotonic()
        if now_s < self._due_s:
            return
        self._due_s = now_s + REACH_PERIOD_S
        if self._info.peers_zid() or self._info.routers_zid():
            self._due_s = math.inf
            if self._logged:
                logger.info("reached another participant after %.0f s", now_s - self._started_s)
        elif not self._logged:
            self._logged = True
            logger.warning("no other participant reached at %s within %.0f s; connecting continues", self._where, REACH_S)


class Declared(Protocol):
    """A declaration on a session."""

    def undeclare(self) -> None: ...


def close_session(session: zenoh.Session, declared: Iterable[Declared] = ()) -> None:
    """Undeclare in this order and close; returns after CLOSE_S at the latest: Zenoh goes on in the background then."""

    def close() -> None:
        try:
            for one in declared:
                with suppress(zenoh.ZError):  # the session has been closed
                    one.undeclare()
        finally:
            if not session.is_closed():
                session.close()  # type: ignore[no-untyped-call]  # its stub lacks "-> None"

    closing = threading.Thread(target=close, name="zenoh-close", daemon=True)
    closing.start()
    closing.join(CLOSE_S)


def _from_file(path: Path) -> zenoh.Config:
    try:
        return zenoh.Config.from_file(path)
    except (zenoh.ZError, OSError) as error:
        raise BusError(f"{path}: no Zenoh configuration (JSON5): {_reason(error)}") from error


def _insert(config: zenoh.Config, key: str, value: str) -> None:
    try:
        config.insert_json5(key, value)
    except zenoh.ZError as error:
        raise BusError(f"Zenoh option {key} = {value} is rejected: {_reason(error)}") from error


def _check_endpoint(key: str, endpoint: str) -> None:
    protocol, slash, address = endpoint.partition("/")
    if not (protocol.isascii() and protocol.replace("-", "").isalnum() and slash and address) or '"' in endpoint:
        raise BusError(f"{key} = {endpoint!r}: PROTOCOL/ADDRESS expected, such as tcp/192.168.1.2:7447")


def _reason(error: object) -> str:
    return str(error).split(" at /")[0].strip() or type(error).__name__


def free_ports(count: int, named: Collection[int] = ()) -> list[int]:
    """Different free TCP ports of this machine, from a range that systems do not assign.  Raises BusError.

    named: ports that are left out, because other parts of the rig are going to use them.
    """
    found: list[int] = []
    with ExitStack() as stack:
        for port in SystemRandom().sample(PORTS, len(PORTS)):
            if len(found) < count and port not in named:
                try:
                    stack.enter_context(socket.create_server((HOST, port)))
                    found.append(port)
                except OSError as error:  # in use
                    if error.errno in (errno.EMFILE, errno.ENFILE):
                        raise BusError(
                            f"{count} free TCP ports: {error.strerror}: allowed: a higher limit: ulimit -n"
                        ) from error
    if len(found) < count:
        raise BusError(f"{count} free TCP ports: {len(found)} found from {PORTS[0]} to {PORTS[-1]}")
    return found
