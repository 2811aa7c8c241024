"""The animator as a process: rig in, bus open, page served, run."""

import logging
import queue
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Never

from common.bus.protocol import Bus, Envelope
from common.bus.zenoh_bus import ZenohBus
from common.bus.zenoh_session import ZenohOptions
from common.messages import Message, Request
from common.runtime.about import about
from common.runtime.animator_table import PageTable
from common.runtime.clock import Clock, RealClock
from common.runtime.rig import Rig
from common.runtime.service import Event, Service, Subscription, run
from common.runtime.versions import versions
from common.topics import (
    ASSIGNMENT,
    CAMERA,
    HEALTH,
    PARTIAL_BAP,
    POSTURE,
    PREVIEW,
    SIGHTING,
    SILHOUETTE,
    TRACKER_BDP,
    TRACKER_POSE,
    UNIVERSAL_BAP,
    UNIVERSAL_BDP,
)
from services.animator.outputs.opening import Outputs, open_outputs
from services.animator.page import wire
from services.animator.page.display import Shown, show
from services.animator.page.hub import Page, Piece
from services.animator.page.server import PageServer
from services.animator.playback import Playback
from services.animator.snapshot import Actor, Source
from services.animator.states import Setup, State
from services.animator.step import counts, describe, initial_state, step

logger = logging.getLogger(__name__)

ID = "main"
TOPICS = (
    SIGHTING, PARTIAL_BAP, SILHOUETTE, PREVIEW, CAMERA, UNIVERSAL_BDP, ASSIGNMENT, UNIVERSAL_BAP, TRACKER_BDP, TRACKER_POSE,
    HEALTH, POSTURE,
)  # fmt: skip
TICK_NS = 200_000_000
MOST_WISHES = 16  # that wait for the service's loop; more are dropped


def animator_service(
    rig: Rig, where: Callable[[], str] = lambda: "", hear: Callable[[Envelope], None] = lambda _: None
) -> Service[Setup, State, Never]:
    """The animator of a rig.  where: says where its page is, for its health.  hear: gets every message first."""
    optional = {"tracker": rig.tracker, "recognizer": rig.recognizer}
    beside = ((name, "main") for name, spec in optional.items() if spec is not None)
    setup = Setup((*(("viewer", viewer.id) for viewer in rig.viewers), ("integrator", "main"), *beside))

    def heard(setup: Setup, state: State, event: Event[Never]) -> tuple[State, Sequence[Message]]:
        if isinstance(event, Envelope):
            hear(event)
        return step(setup, state, event)

    return Service(
        "animator",
        ID,
        setup,
        initial_state(setup),
        heard,
        tuple(Subscription(topic) for topic in TOPICS),
        lambda state: f"{describe(state)}{where()}",
        counts,
        watch_alive=True,
        tick_ns=TICK_NS,
        derives=False,
    )


def run_animator(rig: Rig, takes: Path, options: ZenohOptions, stopped: Callable[[], bool]) -> int:
    """Run until `stopped`; returns the exit status.  takes: the folder of those that can be played.

    Raises BusError, PageError and ValueError before it runs.
    """
    clock = RealClock()
    with ZenohBus.open(options, rig.name, clock, stopped) as bus:
        bus.introduce(about(rig, "animator", ID, clock.now_ns()))
        desk = Desk(rig, bus, clock, open_outputs(rig.animator, rig.name, clock))
        try:
            if rig.animator.page.enabled:
                desk.open(rig.animator.page, takes)
            service = animator_service(rig, desk.where, desk.outputs.hear)
            return run(
                service, bus, clock, stopped=stopped, extra_counts=desk.outputs.counts, asked=desk.asked, shown=desk.show
            )
        finally:
            desk.close()


class Desk:
    """Where the service's loop and the page's thread meet: states go to pages and outputs, and wishes to the rig."""

    def __init__(self, rig: Rig, bus: Bus, clock: Clock, outputs: Outputs) -> None:
        self._rig, self._bus, self._clock, self.outputs = rig, bus, clock, outputs
        self._source: Source = "tracker" if rig.tracker is not None else "two-view"
        self._sent: Actor | None = None
        self._playback: Playback | None = None
        self._server: PageServer | None = None
        self._wishes: queue.SimpleQueue[wire.Ask] = queue.SimpleQueue()
        self._requests = 0
        self._shown = Shown()
        self._cold = False

    def open(self, table: PageTable, takes: Path) -> None:
        """Serve the page.  Raises PageError."""
        self._server = PageServer(table, self._hear, self._opened)
        self._server.start()
        self._playback = Playback(takes, self._server.hub, self._clock, TOPICS)
        logger.info("the page is at %s", self._server.address)
        hello = wire.Hello(
            self._rig.name, self._rig.method, versions()["zenocap"], [viewer.id for viewer in self._rig.viewers], True
        )
        self._server.hub.publish(None, [Piece("hello", wire.encode(hello))])

    @property
    def address(self) -> str:
        """Of the page, token included; empty without one."""
        return self._server.address if self._server is not None else ""

    @property
    def most_waiting(self) -> int:
        """Pieces that wait for the slowest page."""
        return self._server.hub.most_waiting if self._server is not None else 0

    def close(self) -> None:
        if self._playback is not None:
            self._playback.close()
        if self._server is not None:
            self._server.close()
        self.outputs.close()

    def where(self) -> str:
        """For the health: where the page is, and how many look."""
        if self._server is None:
            return ""
        return f"; page {self._server.address.partition('?')[0]}, {self._server.hub.pages} open"

    def show(self, state: State) -> None:
        """A new state, in the service's loop; costs next to nothing while no page is open."""
        actor = state.actors.get(self._source)
        if actor is not None and actor is not self._sent:
            self._sent = actor
            self.outputs.send(actor, state.posture.label if state.posture is not None else None)
        if self._server is None or not self._server.hub.pages:
            return
        if self._cold:
            self._cold, self._shown = False, Shown()
        self._shown, pieces = show(self._shown, state, self._server.hub.pages)
        if pieces:
            self._server.hub.publish("live", pieces)

    def asked(self) -> Sequence[Request]:
        """What the pages ask of the rig, in the service's loop."""
        requests: list[Request] = []
        while not self._wishes.empty():
            wish = self._wishes.get()
            requests.append(Request(frame=self._requests, captured_ns=self._clock.now_ns(), what=wish.what))
            self._requests += 1
        return requests

    def _opened(self) -> None:
        self._cold = True
        self._bus.wake()

    def _hear(self, page: Page, wish: wire.Wish) -> None:
        """In the page's thread."""
        match wish:
            case wire.Ask() if self._wishes.qsize() < MOST_WISHES:
                self._wishes.put(wish)
                self._bus.wake()
            case wire.Watch(feed=feed) if self._server is not None:
                self._server.hub.watch(page, feed)
            case wire.ListTakes() if self._playback is not None:
                page.put(Piece("takes", wire.encode(self._playback.takes())))
            case wire.Play() | wire.Control() if self._playback is not None:
                self._playback.order(wish)
