"""Passing a list of revocations to the routers of a rig, and asking them which one they apply."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import msgspec
import zenoh

from zenocap.common.bus.protocol import BusError
from zenocap.common.bus.zenoh_session import ZenohOptions, configuration, open_session
from zenocap.common.topics import REVOKED

OPEN_S = 5.0  # time for a router to be reached; chosen by hand
CONFIRM_S = 20.0  # time for routers to open again and answer, on a loaded network; chosen by hand
SESSION_S = 3.0  # of a session's questions: one that was opened just before its router closed may get no answer; by hand
QUERY_TIMEOUT_S, PAUSE_S = 0.5, 0.2  # of one query, and between two; chosen by hand


class _Numbered(msgspec.Struct):
    number: int = 0


@contextmanager
def sender(options: ZenohOptions | None, rig: str) -> Iterator[Callable[[bytes], bool]]:
    """Function that sends an encoded list to the routers of a rig, and returns whether a router was reached.

    options: of a client; None for a rig without a router.
    """
    session = _opened(options) if options is not None else None
    if session is None:
        yield lambda data: False
        return

    def send(data: bytes) -> bool:
        end_s = time.monotonic() + OPEN_S
        while not publisher.matching_status.matching:  # type: ignore[attr-defined]  # its stub has it as a bool
            if time.monotonic() > end_s:
                return False
            time.sleep(PAUSE_S)
        publisher.put(data)
        return True

    with session:
        publisher = session.declare_publisher(
            REVOKED.format(rig=rig), congestion_control=zenoh.CongestionControl.BLOCK, express=True
        )
        yield send


def confirmed(options: ZenohOptions, rig: str, number: int) -> int:
    """Number of routers that apply the list of this number, or a later one; 0 when none answers within CONFIRM_S."""
    end_s, found = time.monotonic() + CONFIRM_S, 0
    while not found and time.monotonic() < end_s and (session := _opened(options)) is not None:
        with session:
            again_s = min(end_s, time.monotonic() + SESSION_S)
            while not found and time.monotonic() < again_s:
                time.sleep(PAUSE_S)
                replies = session.get(REVOKED.format(rig=rig), timeout=QUERY_TIMEOUT_S, target=zenoh.QueryTarget.ALL,
                                      consolidation=zenoh.ConsolidationMode.NONE)  # fmt: skip
                found = sum(reply.ok is not None and _number(reply.ok.payload.to_bytes()) >= number for reply in replies)
    return found


def _opened(options: ZenohOptions) -> zenoh.Session | None:
    """A session; None when no router is reached within OPEN_S.  Raises BusError for files that cannot be used."""
    configuration(options)
    end_s = time.monotonic() + OPEN_S
    try:
        return open_session(options, lambda: time.monotonic() > end_s)
    except BusError:
        return None


def _number(data: bytes) -> int:
    try:
        return msgspec.json.decode(data, type=_Numbered).number
    except (ValueError, RecursionError):
        return 0
