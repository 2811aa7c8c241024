"""Bridge between the service loop and the page's thread."""

import logging
import queue
from collections.abc import Mapping, Sequence
from pathlib import Path

from zenocap.common.bus.protocol import Bus
from zenocap.common.messages import Request
from zenocap.common.rig.animator import PageTable
from zenocap.common.rig.methods import method_of
from zenocap.common.rig.rig import Rig
from zenocap.common.runtime.clock import Clock
from zenocap.common.runtime.service_info import versions
from zenocap.common.topics import TRACKER_POSE, Topic
from zenocap.services.animator.outputs.output_group import OutputGroup
from zenocap.services.animator.page import page_messages as pm
from zenocap.services.animator.page.broadcast import EncodedUpdate, PageQueue
from zenocap.services.animator.page.drop_receiver import DropReceiver
from zenocap.services.animator.page.page_updates import Schedule, due_updates, recording_update
from zenocap.services.animator.page.save_messages import CancelSaving, SaveTake, SavingUpdate
from zenocap.services.animator.page.server import PageServer, animator_content
from zenocap.services.animator.parameters import MAX_REQUESTS, RECORD_PERIOD_NS, SAVING_NICENESS
from zenocap.services.animator.playback import Playback, PlayFile
from zenocap.services.animator.save_job import SaveJob
from zenocap.services.animator.states import Actor, Source, State

logger = logging.getLogger(__name__)


class PageBridge:
    """Pages and outputs of one animator.  Its methods are called by the service loop, `_receive` by the page's thread."""

    def __init__(self, rig: Rig, bus: Bus, clock: Clock, outputs: OutputGroup) -> None:
        self._rig, self._bus, self._clock, self.outputs = rig, bus, clock, outputs
        self._source: Source = "tracker" if method_of(rig.method).poses is TRACKER_POSE else "two-view"
        self._sent: Actor | None = None
        self._playback: Playback | None = None
        self._saving: SaveJob | None = None
        self._server: PageServer[pm.Command] | None = None
        self._requests: queue.SimpleQueue[pm.RigRequest] = queue.SimpleQueue()
        self._request_count = 0
        self._recorded_ns: int | None = None  # time of the last command that starts or stops the recording
        self._schedule = Schedule()
        self._restart_schedule = False

    def open(self, table: PageTable, takes: Path, topics: tuple[Topic, ...]) -> None:
        """Serve the page.  takes: folder of the takes that can be played; topics: shown of them.  Raises UserError."""
        drops = DropReceiver(self._on_drop)
        self._server = PageServer(table, self._receive, self._first_page_opened, animator_content(), drops)
        self._server.start()
        self._playback = Playback(takes, self._server.broadcaster, self._clock, topics)
        self._saving = SaveJob(self._on_saving, self._server.offered.offer, SAVING_NICENESS)
        logger.info("the page is at %s", self._server.address)
        viewers = [viewer.id for viewer in self._rig.viewers]
        recognizer = self._rig.recognizer
        commands = [] if recognizer is None else [(one.posture, one.action.target) for one in recognizer.commands]
        hello = pm.HelloUpdate(self._rig.name, self._rig.method, versions()["zenocap"], viewers, commands=commands)
        self._server.broadcaster.publish(None, [EncodedUpdate("hello", pm.encode(hello))])

    @property
    def address(self) -> str:
        """URL of the page, token included; "" without a page."""
        return self._server.address if self._server is not None else ""

    @property
    def longest_queue(self) -> int:
        """Number of updates that wait for the slowest page."""
        return self._server.broadcaster.longest_queue if self._server is not None else 0

    def counts(self) -> Mapping[str, int]:
        """Counters of outputs and page for the health."""
        return {**self.outputs.counts(), **(self._server.counts() if self._server is not None else {})}

    def close(self) -> None:
        if self._saving is not None:
            self._saving.close()
        if self._playback is not None:
            self._playback.close()
        if self._server is not None:
            self._server.close()
        self.outputs.close()

    def health_text(self) -> str:
        """Return the page's address, without the token, and the number of open pages."""
        if self._server is None:
            return ""
        return f"; page {self._server.address.partition('?')[0]}, {self._server.broadcaster.pages} open"

    def show(self, state: State) -> None:
        """Send a new state to outputs and pages."""
        actor = state.actors.get(self._source)
        if actor is not None and actor is not self._sent:
            self._sent = actor
            self.outputs.send(actor, state.posture.label if state.posture is not None else None)
        if self._server is None or not self._server.broadcaster.pages:
            return
        if self._restart_schedule:
            self._restart_schedule, self._schedule = False, Schedule()
        self._schedule, updates = due_updates(self._schedule, state, self._server.broadcaster.pages)
        if updates:
            self._server.broadcaster.publish("live", updates)
            if any(update.key == "services" for update in updates):  # also for pages that show a take
                self._server.broadcaster.publish(None, [recording_update(state)])

    def requests(self) -> Sequence[Request]:
        """Return the requests of the pages since the last call."""
        found: list[Request] = []
        while not self._requests.empty():
            request = self._requests.get()
            found.append(Request(frame=self._request_count, captured_ns=self._clock.now_ns(), what=request.what))
            self._request_count += 1
        return found

    def _first_page_opened(self) -> None:
        self._restart_schedule = True
        self._bus.wake()

    def _receive(self, page: PageQueue, command: pm.Command) -> None:
        """Handle a command of a page.  Raises ValueError with the reason for one that is refused."""
        match command:
            case pm.RigRequest(what=("record" | "stop_recording")) if not self._may_record():
                raise ValueError("refused: the recording was started or stopped less than a second ago; try it again")
            case pm.RigRequest() if self._requests.qsize() < MAX_REQUESTS:
                self._requests.put(command)
                self._bus.wake()
            case pm.RigRequest():
                raise ValueError("refused: too many commands wait")
            case pm.SelectFeed(feed=feed) if self._server is not None:
                self._server.broadcaster.select_feed(page, feed)
            case pm.ListTakes() if self._playback is not None:
                page.put(EncodedUpdate("takes", pm.encode(self._playback.takes())))
            case pm.PlayTake() | pm.ControlPlayer() if self._playback is not None:
                self._playback.send(command)
            case SaveTake():
                self._save(command)
            case CancelSaving() if self._saving is not None:
                self._saving.cancel()

    def _on_drop(self, path: Path) -> None:
        """Play a dropped take, to the pages that show a take."""
        if self._playback is not None:
            self._playback.send(PlayFile(path))

    def _save(self, command: SaveTake) -> None:
        """Save the take that is played beside it.  Raises ValueError."""
        take = None if self._playback is None else self._playback.current
        if self._playback is None or take is None or self._saving is None:
            raise ValueError("refused: no take is played: play one first")
        self._saving.start(command, take, take.parent, kept=self._playback.owns(take))

    def _on_saving(self, update: SavingUpdate) -> None:
        if self._server is not None:
            self._server.broadcaster.publish(None, [EncodedUpdate("saving", pm.encode(update))])

    def _may_record(self) -> bool:
        """Whether the last command that starts or stops the recording is long enough ago."""
        now_ns = self._clock.elapsed_ns()
        if self._recorded_ns is not None and now_ns - self._recorded_ns < RECORD_PERIOD_NS:
            return False
        self._recorded_ns = now_ns
        return True
