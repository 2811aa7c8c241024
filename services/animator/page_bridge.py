"""Bridge between the service loop and the page's thread."""

import logging
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Never

from zenocap.common.bus.protocol import Alive, Bus, Envelope
from zenocap.common.messages import Request
from zenocap.common.observe.view import RigView
from zenocap.common.recording.channel_limits import ChannelLimits
from zenocap.common.rig.animator import PageTable
from zenocap.common.rig.methods import method_of
from zenocap.common.rig.rig import Rig
from zenocap.common.rig.services import services_of
from zenocap.common.runtime.clock import Clock
from zenocap.common.runtime.service import Event
from zenocap.common.runtime.service_info import versions
from zenocap.common.topics import TRACKER_POSE, Topic
from zenocap.common.web.broadcast import PageQueue, encoded
from zenocap.services.animator.outputs.output_group import OutputGroup
from zenocap.services.animator.page import page_messages as pm
from zenocap.services.animator.page.page_updates import Schedule, due_updates, recording_update
from zenocap.services.animator.page.save_messages import SaveTake
from zenocap.services.animator.parameters import RECORD_PERIOD_NS, SAVING_NICENESS
from zenocap.services.animator.playback import PlayFile, TakePlayer
from zenocap.services.animator.presence import Presence, observed, troubled
from zenocap.services.animator.save_command import format_choices
from zenocap.services.animator.simulated_truth import distances, simulated_motion
from zenocap.services.animator.states import ActorPose, AnimatorState, Source
from zenocap.services.animator.take_feed import TakeFeed

logger = logging.getLogger(__name__)


class PageBridge:
    """Pages and outputs of one animator.  Its methods are called by the service loop, `_direct` by the page's thread."""

    def __init__(self, rig: Rig, bus: Bus, clock: Clock, outputs: OutputGroup) -> None:
        self._rig, self._bus, self._clock, self.outputs = rig, bus, clock, outputs
        self._limits = ChannelLimits("outputs of the animator", rig.name, services_of(rig))
        self._source: Source = "tracker" if method_of(rig.method).poses is TRACKER_POSE else "two-view"
        self._sent: ActorPose | None = None
        self._feed: TakeFeed | None = None
        self._request_count = 0
        self._recorded_ns: int | None = None  # time of the last command that starts or stops the recording
        self._presence = Presence(RigView(rig.name, services_of(rig, required=True)))
        self._schedule, self._openings = Schedule(), 0
        self._motion = simulated_motion(rig)

    def open(self, table: PageTable, takes: Path, topics: tuple[Topic, ...]) -> None:
        """Serve the page.  takes: folder of the takes that can be played; topics: shown of them.  Raises UserError."""
        viewers = [viewer.id for viewer in self._rig.viewers]
        recognizer = self._rig.recognizer
        commands = [] if recognizer is None else [(one.posture, one.action.target) for one in recognizer.commands]
        feed = self._feed = TakeFeed(table, self._direct, self._on_drop, self._bus.wake, SAVING_NICENESS)
        rig, version = self._rig, versions()["zenocap"]
        feed.open(pm.HelloUpdate(rig.name, rig.method, version, viewers, commands=commands, formats=format_choices()))
        feed.player = TakePlayer(takes, feed.page.updates, self._clock, topics)
        logger.info("the page is at %s", feed.page.address)

    @property
    def address(self) -> str:
        """URL of the page, token included; "" without a page."""
        return self._feed.page.address if self._feed is not None else ""

    def counts(self) -> Mapping[str, int]:
        """Counters of outputs and page for the health."""
        return {**self.outputs.counts(), **(self._feed.page.counts() if self._feed is not None else {})}

    def close(self) -> None:
        if self._feed is not None:
            self._feed.close()
        self.outputs.close()

    def health_text(self) -> str:
        """Return services that are stale or gone, the page's address, without the token, and the number of open pages."""
        found = troubled(self._presence, self._clock.elapsed_ns())
        text = f"; stale or gone: {', '.join(found)}" if found else ""
        if self._feed is None:
            return text
        return f"{text}; page {self.address.partition('?')[0]}, {self._feed.page.pages} open"

    def receive(self, event: Event[Never]) -> None:
        """Handle an event of the service before its step."""
        if isinstance(event, Envelope) and self._limits.admits(event.key):
            self.outputs.receive(event)
        if isinstance(event, Envelope | Alive):
            self._presence = observed(self._presence, event, self._clock.elapsed_ns())

    def show(self, state: AnimatorState) -> None:
        """Send a new state to outputs and pages."""
        actor = state.actors.get(self._source)
        if actor is not None and actor is not self._sent:
            self._sent = actor
            self.outputs.send(actor, state.posture.label if state.posture is not None else None)
        if self._feed is None or not self._feed.page.pages:
            return
        page = self._feed.page
        if page.openings != self._openings:
            self._openings, self._schedule = page.openings, Schedule()
        now_ns = self._clock.elapsed_ns()
        self._schedule, updates = due_updates(self._schedule, state, self._presence, page.pages, now_ns)
        if any(update.key == "services" for update in updates):
            if self._motion is not None:
                updates.append(encoded("distances", pm.DistancesUpdate(distances(self._motion, state))))
            page.updates.publish(None, [recording_update(self._presence)])  # also for pages that show a take
        if updates:
            page.updates.publish("live", updates)

    def requests(self) -> Sequence[Request]:
        """Return the requests of the pages since the last call."""
        found: list[Request] = []
        for command in self._feed.page.commands() if self._feed is not None else ():
            assert isinstance(command, pm.RigRequest)  # the others are handled by `_direct`
            found.append(Request(frame=self._request_count, captured_ns=self._clock.now_ns(), what=command.what))
            self._request_count += 1
        return found

    def _direct(self, page: PageQueue, command: pm.Command) -> bool:
        """Handle a command of a page in the server's thread; False for one that goes to the rig.  Raises ValueError."""
        feed = self._feed
        assert feed is not None  # it has the page
        match command:
            case pm.RigRequest(what=("record" | "stop_recording")) if not self._may_record():
                raise ValueError("refused: the recording was started or stopped less than a second ago; try it again")
            case pm.RigRequest():
                return False
            case SaveTake():
                self._save(feed, command)
            case pm.ListTakes() if feed.player is not None:
                page.put(encoded("takes", feed.player.takes()))
            case pm.PlayTake() if feed.player is not None:
                feed.player.send(command)
            case _:
                feed.receive(page, command)
        return True

    def _on_drop(self, path: Path) -> None:
        """Play a dropped take, to the pages that show a take."""
        if self._feed is not None and self._feed.player is not None:
            self._feed.player.send(PlayFile(path))

    def _save(self, feed: TakeFeed, command: SaveTake) -> None:
        """Save the take that is played beside it.  Raises ValueError."""
        take = feed.player.current if feed.player is not None else None
        if feed.player is None or take is None:
            raise ValueError("refused: no take is played: play one first")
        feed.saving.start(command, take, take.parent, kept=feed.player.owns(take))

    def _may_record(self) -> bool:
        """Whether the last command that starts or stops the recording is long enough ago."""
        now_ns = self._clock.elapsed_ns()
        if self._recorded_ns is not None and now_ns - self._recorded_ns < RECORD_PERIOD_NS:
            return False
        self._recorded_ns = now_ns
        return True
