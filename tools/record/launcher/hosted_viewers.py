"""Viewers that other machines run, assigned while the rig runs."""

import threading
import time
from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import repeat
from pathlib import Path

from zenocap.common.bus.zenoh_film import FilmSession
from zenocap.common.codec import BadMessage
from zenocap.common.messages import AssignQuery, AssignReply, CameraHost
from zenocap.common.rig.hosted import HostedCamera
from zenocap.common.rig.sources import Announced
from zenocap.common.runtime.foreign_text import printable
from zenocap.common.topics import HOST_ASSIGN
from zenocap.tools.setup.cameras.hosts import host_problem

PERIOD_S = 2.0  # between queries, well below the lease of an assignment; chosen by hand
ANSWER_S = 1.0  # for the answer to each; chosen by hand
PATIENCE_S = 4.0  # in which a machine may be found, or be away, before that is reported; chosen by hand
RELEASE_S = 10.0  # for a viewer to end on a machine that answers; chosen by hand
CLOCK_S = 60.0  # of another machine's clock from this one's, from which it is reported; chosen by hand


@dataclass
class _State:
    """Of one viewer.  told, problem: last ones.  good_s: of its last good answer, monotonic.  assigned: its host obeyed."""

    camera: HostedCamera
    query: AssignQuery
    good_s: float
    told: str = ""
    problem: str = ""
    has_run: bool = False
    assigned: bool = False
    clock_told: bool = False


class HostedViewers:
    """Assigns the viewers every PERIOD_S s, on a thread, until `close`: a machine that comes back gets its viewer again."""

    def __init__(self, session: FilmSession, cameras: Sequence[HostedCamera], query: Callable[[str], AssignQuery]) -> None:
        """query: that assigns a viewer, by its id.  Raises UserError."""
        now_s = time.monotonic()
        self._session = session
        self._states = [_State(one, query(one.viewer), now_s) for one in cameras]
        self._news: list[str] = []
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._work, name="hosted-viewers", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def news(self) -> Iterator[str]:
        """Texts since the last call."""
        while self._news:
            yield self._news.pop(0)

    @property
    def never_ran(self) -> list[str]:
        """Texts about the viewers that have never run."""
        missing = [one for one in self._states if not one.has_run]
        return [f"viewer {one.camera.viewer} has not run: {one.problem or 'not found in time'}" for one in missing]

    def close(self) -> None:
        """Give all cameras back, all at once, and wait for the viewers of machines that are not frozen."""
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join(len(self._states) * ANSWER_S + 2 * PERIOD_S)
        assigned = [one for one in self._states if one.assigned]
        there = {host.machine for host in self._hosts()} if assigned else set()
        with ThreadPoolExecutor(len(self._states)) as pool:
            list(pool.map(self._release, assigned, repeat(there)))
        self._session.close()

    def _release(self, one: _State, there: Collection[str]) -> None:
        """there: machines that answer."""
        query = AssignQuery(frame=0, captured_ns=time.time_ns(), what="release", rig=one.query.rig)
        self._session.assign(_key(one.camera.source), query, RELEASE_S if one.camera.source.machine in there else ANSWER_S)

    def _hosts(self) -> list[CameraHost]:
        return [one for one in self._session.hosts(ANSWER_S) if isinstance(one, CameraHost)]

    def _work(self) -> None:
        while not self._stop.is_set():
            hosts = self._hosts()
            for one in self._states:
                if not self._stop.is_set():
                    self._assign(one, hosts)
            self._stop.wait(PERIOD_S)

    def _assign(self, one: _State, hosts: Sequence[CameraHost]) -> None:
        problem = host_problem(one.camera.source, hosts)
        if not problem:
            begin_ns = time.time_ns()
            try:
                reply = self._session.assign(_key(one.camera.source), one.query, ANSWER_S)
            except BadMessage as error:
                reply = str(error)
            problem = answer_problem(one.camera.source, reply)
            if isinstance(reply, AssignReply):
                one.assigned |= not reply.refused
                self._check_clock(one, reply.captured_ns - (begin_ns + time.time_ns()) // 2)
        one.problem, now_s = problem, time.monotonic()
        if not problem:
            text = f"viewer {one.camera.viewer} runs on {one.camera.source.machine}"
            one.good_s, one.has_run = now_s, True
        else:
            text = f"viewer {one.camera.viewer}: {problem}"
            if now_s - one.good_s < PATIENCE_S:
                return
        if text != one.told:
            one.told = text
            self._news.append(text)

    def _check_clock(self, one: _State, offset_ns: int) -> None:
        if abs(offset_ns) > CLOCK_S * 1e9 and not one.clock_told:
            one.clock_told = True
            self._news.append(
                f"note: the clock of {one.camera.source.machine} is {abs(offset_ns) / 1e9:.0f} s "
                f"{'ahead' if offset_ns > 0 else 'behind'}: corrected for tracking; its logs and films have that time"
            )


def answer_problem(source: Announced, reply: AssignReply | str | None) -> str:
    """Reason that a camera host does not run the viewer, and the remedy; empty where it does."""
    if reply is None:
        return (
            f"{source.machine} does not answer: it is away, or has an older zenocap: install the same release there and "
            "run zenocap viewer --discover again"
        )
    if isinstance(reply, str):
        return f"{source.machine}: {printable(reply)}; where that is another release: install the same there"
    if reply.refused:
        return f"refused by {source.machine}: {printable(reply.refused)}"
    if reply.state != "running":
        return f"failed on {source.machine}, which starts it again: {printable(reply.failure)}"
    return ""


def secured_advice(cameras: Sequence[HostedCamera], rig: Path) -> Iterator[str]:
    """Remedy for cameras of other machines in a secured rig, whose viewers need certificates of their own."""
    for one in cameras:
        yield (
            f"viewer {one.viewer}: the rig has certificates, and none travels over the network: copy {rig.name}, the "
            f"calibration and the certificate viewer-{one.viewer} to {one.source.machine} and run there: zenocap viewer "
            f"{rig.name} --id {one.viewer}"
        )


def _key(source: Announced) -> str:
    return HOST_ASSIGN.format(machine=source.machine, camera=source.camera)
