"""Zenoh router that enforces access rules and revocations.

Zenoh reads certificates and access rules when a session opens.  So the router opens its session again when a newer list of
revocations arrives or its files change.  All links end, and members are back within about a second, except revoked ones.
"""

import logging
import math
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.util import find_spec
from typing import TypeAlias

import zenoh

from zenocap.common.atomic_write import write_atomically
from zenocap.common.bus.certificate import Expiry
from zenocap.common.bus.revocations import BadRevocations, Revocations, read_revocations
from zenocap.common.bus.security import ROUTER_PORT, RouterFiles
from zenocap.common.bus.zenoh_session import ZenohOptions, open_session
from zenocap.common.errors import UserError, pip_install
from zenocap.common.topics import REVOKED

logger = logging.getLogger(__name__)

POLL_S = 0.1  # period at which the files of certificates are looked at, and the end; chosen by hand
QUERY_TIMEOUT_S = 0.5  # for the lists of other routers; chosen by hand
ASK_S = 10.0  # period at which other routers are asked; chosen by hand
SETTLED_S = 0.5  # without a change of the files; chosen by hand
# Threads on which Zenoh receives.  A session whose program is frozen (stopped, suspended) holds one from the end of its
# lease on: with Zenoh's default of 2, four frozen readers stopped the whole rig.  Measured with 16 of them.
ZENOH_THREADS = ("ZENOH_RUNTIME", "(rx: (worker_threads: 32))")
RETRY_S = 1.0  # after a failure to open again; chosen by hand
_State: TypeAlias = list[tuple[int, int] | None]


class RevocationList:
    """The newest list known here: of the file at first, then of the network.  Its methods are called by several threads."""

    def __init__(self, files: RouterFiles) -> None:
        """Read the file.  Raises BadRevocations."""
        self._files = files
        self.known = Revocations()
        self.read_file()

    def read_file(self) -> None:
        """Take over the list of the file if it is newer.  Raises BadRevocations."""
        if self._files.revoked.is_file():
            found = read_revocations(str(self._files.revoked), self._files.revoked.read_bytes(), self._authority())
            if found.number > self.known.number:
                self.known = found

    def offer(self, name: str, data: bytes) -> bool:
        """Take over a list if it is signed and newer; whether it was.  name: of where it came from."""
        try:
            found = read_revocations(name, data, self._authority())
        except BadRevocations as error:
            logger.warning("ignored: %s", error)
            return False
        if found.number <= self.known.number:
            return False
        self.known = found
        logger.warning("revocations: list %d received", found.number)
        try:
            write_atomically(self._files.revoked, data)
        except OSError as error:
            logger.error("%s: %s: this list is lost when the router ends", self._files.revoked, error.strerror)
        return True

    def _authority(self) -> bytes:
        return self._files.authority.read_bytes()


def router(
    options: Callable[[Revocations], ZenohOptions], stopped: Callable[[], bool], files: RouterFiles | None = None
) -> None:
    """Run until `stopped`.  options: of a session, for a list of revocations.  files: of a secured router, else None.

    Raises BusError when it cannot listen, and BadRevocations.
    """
    os.environ.setdefault(*ZENOH_THREADS)  # read when this process opens its first session
    revocations = None
    if files is not None:
        if find_spec("cryptography") is not None:
            revocations = RevocationList(files)
        elif files.revoked.exists():
            raise BadRevocations(f"{files.revoked}: its signature cannot be checked: {pip_install('certs')}")
        else:
            logger.warning("revocations are not received and not enforced here: %s", pip_install("certs"))
    opened = False
    while not stopped():
        known, before = revocations.known if revocations else Revocations(), _state(files)
        try:
            one = replace(options(known), mode="router")
            with open_session(one, stopped) as session:
                default = f"{'tls' if one.security else 'tcp'}/[::]:{ROUTER_PORT}"
                logger.info("router %s listens on %s", session.zid(), ", ".join(one.listen) or default)
                opened = True
                _wait(session, stopped, files, revocations, before)
        except UserError as error:
            if not opened:
                raise
            logger.error("%s", error)  # such as a missing key, which is still being copied
            time.sleep(RETRY_S)
        if not stopped() and revocations is not None:
            try:
                revocations.read_file()
            except UserError as error:
                logger.error("%s", error)


def _wait(
    session: zenoh.Session, stopped: Callable[[], bool], files: RouterFiles | None, revocations: RevocationList | None,
    before: _State,
) -> None:  # fmt: skip
    """Return when `stopped`, or when the session is to be opened again.  before: state of the files."""
    known = revocations.known if revocations is not None else None
    expiry = Expiry(files.certificate, logger) if files is not None else None
    if revocations is not None and files is not None:
        _serve(session, files.rigs, revocations)
    asked_s = -math.inf
    while not stopped() and (revocations is None or revocations.known is known):
        if _state(files) != before:
            _settle(files, stopped)
            break
        if time.monotonic() - asked_s >= ASK_S:
            asked_s = time.monotonic()
            if expiry is not None:
                expiry.days_left(time.time_ns())
            if revocations is not None and files is not None:
                _ask(session, files.rigs, revocations)
        time.sleep(POLL_S)
    if not stopped():
        logger.info("certificates or revocations have changed: the router opens again")


def _settle(files: RouterFiles | None, stopped: Callable[[], bool]) -> None:
    """Return when the files have not changed for SETTLED_S: a key and its certificate are two files."""
    state, since_s = _state(files), time.monotonic()
    while not stopped() and time.monotonic() - since_s < SETTLED_S:
        time.sleep(POLL_S)
        if _state(files) != state:
            state, since_s = _state(files), time.monotonic()


def _serve(session: zenoh.Session, rigs: Sequence[str], revocations: RevocationList) -> None:
    """Receive lists of these rigs, and answer with the one that this session applies."""
    applied = revocations.known
    for rig in rigs:
        key = REVOKED.format(rig=rig)

        def answer(query: zenoh.Query, key: str = key) -> None:
            with query:
                if applied.number:
                    query.reply(key, applied.encoded())

        session.declare_subscriber(key, lambda sample: _offer(sample, revocations))
        session.declare_queryable(key, answer)


def _ask(session: zenoh.Session, rigs: Sequence[str], revocations: RevocationList) -> None:
    """Ask other routers for their lists; the own one is among the answers."""
    for rig in rigs:
        for reply in session.get(REVOKED.format(rig=rig), timeout=QUERY_TIMEOUT_S, target=zenoh.QueryTarget.ALL):
            if reply.ok is not None:
                _offer(reply.ok, revocations)


def _offer(sample: zenoh.Sample, revocations: RevocationList) -> None:
    revocations.offer(str(sample.key_expr), sample.payload.to_bytes())


def _state(files: RouterFiles | None) -> _State:
    """Time and size of the watched files; None for a missing one."""
    found: _State = []
    for path in files.watched if files is not None else ():
        try:
            status = path.stat()
            found.append((status.st_mtime_ns, status.st_size))
        except OSError:
            found.append(None)
    return found
