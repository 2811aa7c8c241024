"""Playback of takes on the page by a `zenocap replay` process on a private network.

One thread handles the commands.  The replay publishes over loopback to a session that only this module opens; its
messages go through the same step as live ones, to the pages that show the feed "take".
"""

import logging
import queue
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from zenocap.common.bus.protocol import Alive, BusError, Envelope, Tick
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions, free_ports
from zenocap.common.errors import UserError
from zenocap.common.observe.view import RigView
from zenocap.common.recording.setup_file import setup_of
from zenocap.common.recording.summary import Summary, read_summary
from zenocap.common.rig.folder import with_suffix
from zenocap.common.runtime.clock import Clock
from zenocap.common.runtime.service import received
from zenocap.common.topics import BOTH_WAYS_POSE, TRACKER_POSE, Topic
from zenocap.common.web.broadcast import Broadcaster, EncodedUpdate, encoded
from zenocap.services.animator import parameters
from zenocap.services.animator.opening import opening_state
from zenocap.services.animator.page import page_messages as pm
from zenocap.services.animator.page.page_updates import Schedule, due_updates
from zenocap.services.animator.presence import Presence, observed
from zenocap.services.animator.replay_process import REPLAYED_RIG, ReplayProcess
from zenocap.services.animator.states import ActorPose, AnimatorSetup, AnimatorState
from zenocap.services.animator.step import step
from zenocap.services.animator.take_marks import postures_update, verdict_update

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class StopPlayer:
    """Stop the take that is played; with `shut_down` also the player's thread."""

    shut_down: bool = False


@dataclass(frozen=True)
class PlayFile:
    """Play a take that is not in the folder."""

    path: Path


PlayerCommand = pm.PlayTake | PlayFile | pm.ControlPlayer | StopPlayer


class TakePlayer:
    """Player of the takes in a folder.  topics: the shown ones.  on_update: called with every state of the player.

    on_pose: called with every pose, and again when the shift is known better: by how much its capture time is later than
    recorded, ns.  raw: show the poses of the forward pass also of takes that were tracked both ways.  current: the take
    that is played; None while none is.
    """

    def __init__(
        self,
        folder: Path,
        broadcaster: Broadcaster,
        clock: Clock,
        topics: tuple[Topic, ...],
        on_update: Callable[[pm.PlayerUpdate], None] = lambda update: None,
        on_pose: Callable[[ActorPose, int], None] = lambda actor, shift_ns: None,
        *,
        raw: bool = False,
    ) -> None:
        self._raw = raw
        self._folder, self._broadcaster, self._clock, self._topics = folder, broadcaster, clock, topics
        self._on_update, self._on_pose = on_update, on_pose
        self.current: Path | None = None
        self._opened = 0  # number of takes that were played
        self._commands: queue.SimpleQueue[PlayerCommand] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="playback", daemon=True)
        self._thread.start()

    def owns(self, take: Path) -> bool:
        """Whether a take is in the folder, and was not dropped on the page."""
        return take.parent == self._folder

    def takes(self) -> pm.TakesUpdate:
        """Return the takes in the folder, newest first."""
        try:
            found = [
                (path.stat().st_mtime, path.name, path.stat().st_size) for path in with_suffix(self._folder, (".mcap",))
            ]
        except (OSError, UserError) as error:
            logger.warning("takes cannot be listed: %s", error)
            found = []
        return pm.TakesUpdate([(name, size / 1e6) for _, name, size in sorted(found, reverse=True)[: parameters.MAX_TAKES]])

    def send(self, command: PlayerCommand) -> None:
        """Queue a command; callable from any thread, never blocks.  Commands beyond MAX_PLAYER_COMMANDS are dropped."""
        if self._commands.qsize() < parameters.MAX_PLAYER_COMMANDS:
            self._commands.put(command)

    def close(self) -> None:
        self._commands.put(StopPlayer(shut_down=True))
        self._thread.join(2 * parameters.REPLAY_TIMEOUT_S)

    def _run(self) -> None:
        command: PlayerCommand | None = None
        while True:
            command = command or self._commands.get()
            match command:
                case pm.PlayTake(take=take):
                    command = self._play(self._folder / take)
                case PlayFile(path=path):
                    command = self._play(path)
                case StopPlayer(shut_down=True):
                    return
                case _:
                    command = None

    def _publish(self, update: pm.PlayerUpdate) -> None:
        self._broadcaster.publish(None, [encoded("player", update)])
        self._on_update(update)

    def _play(self, path: Path) -> PlayerCommand | None:
        """Play until the take ends or another command comes, which is returned."""
        take = path.name
        self._opened += 1
        if not path.is_file():
            self._publish(pm.PlayerUpdate("", problem=f"{take}: no such take"))
            return None
        port, pose_s, summary = free_ports(1)[0], _pose_s(path), _summary(path)
        start_ns = None if summary is None else summary.start_ns  # where the position of the player is 0
        topics = topics_shown(path, self._topics, raw=self._raw)
        options = ZenohOptions(mode="peer", listen=(f"tcp/127.0.0.1:{port}",), multicast_scouting=False)
        self._broadcaster.clear("take")
        try:
            with ZenohBus.open(options, REPLAYED_RIG, self._clock) as bus:
                for topic in topics:
                    bus.subscribe(topic)
                bus.watch_alive()
                with ReplayProcess(path, port) as replay:
                    self.current = path
                    self._publish(pm.PlayerUpdate(take, opened=self._opened))
                    self._show_opening(path, topics, start_ns)
                    self._broadcaster.publish(None, [encoded("verdict", verdict_update(path))])
                    reading = threading.Event()
                    arguments = (path, summary, reading)
                    threading.Thread(target=self._send_postures, args=arguments, name="postures", daemon=True).start()
                    try:
                        command = self._show(take, bus, replay, pose_s, start_ns)
                    finally:
                        reading.set()
                        self.current = None
            problem = "" if command else replay.problem()
        except (BusError, OSError) as error:
            command, problem = None, str(error)
        if not isinstance(command, pm.PlayTake | PlayFile):  # else pages would go back to the live rig between two takes
            self._publish(pm.PlayerUpdate("", problem=problem and f"{take}: {problem}"))
        return command

    def _show_opening(self, path: Path, topics: tuple[Topic, ...], start_ns: int | None) -> None:
        """Send the first pose of a take, if it has one near its beginning: the replay needs seconds to start."""
        state = opening_state(path, topics, self._clock.now_ns())
        if not state.actors:
            return
        now_ns, presence = self._clock.elapsed_ns(), Presence(RigView(REPLAYED_RIG))
        _, updates = due_updates(Schedule(), state, presence, self._broadcaster.pages, now_ns)
        places: list[EncodedUpdate] = []
        for actor in state.actors.values():
            self._on_pose(actor, 0)
            places = _place(actor, start_ns, 0, 0)
        self._broadcaster.publish("take", [*places, *updates])

    def _send_postures(self, path: Path, summary: Summary | None, ended: threading.Event) -> None:
        """Send the postures of a take once they are read, unless playing has `ended`."""
        update = pm.PosturesUpdate() if summary is None else postures_update(path, summary, ended.is_set)
        if not ended.is_set():
            self._broadcaster.publish(None, [encoded("postures", update)])

    def _show(
        self, take: str, bus: ZenohBus, replay: ReplayProcess, pose_s: float, start_ns: int | None
    ) -> PlayerCommand | None:
        """Send the replayed messages to the pages until the replay ends or another command comes, which is returned."""
        setup, presence = AnimatorSetup(), Presence(RigView(REPLAYED_RIG))
        state, schedule = AnimatorState(), Schedule()
        next_ns, published = 0, None
        seen: dict[str, tuple[ActorPose, int]] = {}  # latest pose by source, and its shift
        while replay.running:
            for event in received(bus, parameters.PLAYER_WAIT_S):
                if isinstance(event, Envelope | Alive):
                    state, _ = step(setup, state, event)
                    presence = observed(presence, event, self._clock.elapsed_ns())
            places: list[EncodedUpdate] = []
            status = replay.status
            shift_ns, shift_frames = (0, 0) if status is None else (status.shift_ns, status.shift_frames)
            for source, actor in state.actors.items():
                before = seen.get(source)
                if before is None or before[0] is not actor or before[1] != shift_ns:
                    seen[source] = actor, shift_ns
                    self._on_pose(actor, shift_ns)
                    places = _place(actor, start_ns, shift_ns, shift_frames)
            if self._clock.elapsed_ns() >= next_ns:
                next_ns = self._clock.elapsed_ns() + parameters.PLAYER_PERIOD_NS
                state, _ = step(setup, state, Tick(self._clock.now_ns()))
                if status is not None and status != published:
                    published = status
                    self._publish(
                        pm.PlayerUpdate(
                            take, status.place_s, status.duration_s, status.rate, status.paused, status.problem(), pose_s,
                            self._opened,
                        )
                    )  # fmt: skip
            now_ns = self._clock.elapsed_ns()
            schedule, updates = due_updates(schedule, state, presence, self._broadcaster.pages, now_ns)
            if updates or places:
                self._broadcaster.publish("take", [*places, *updates])
            while not self._commands.empty():
                command = self._commands.get()
                if not isinstance(command, pm.ControlPlayer):
                    return command
                if command.stop:
                    return StopPlayer()
                replay.control(command.paused, command.position_s, command.rate)
        return None


def topics_shown(take: Path, topics: tuple[Topic, ...], *, raw: bool = False) -> tuple[Topic, ...]:
    """The topics, with the poses from both directions in place of those of the forward pass if the take has them.

    raw: the topics as they are.
    """
    summary = None if raw else _summary(take)
    if summary is None or not summary.ids(BOTH_WAYS_POSE):
        return topics
    return tuple(BOTH_WAYS_POSE if topic is TRACKER_POSE else topic for topic in topics)


def _place(actor: ActorPose, start_ns: int | None, shift_ns: int, shift_frames: int) -> list[EncodedUpdate]:
    """Place of a pose in its take; none where the start of the take is unknown.  shift: delay of the replay."""
    if start_ns is None:
        return []
    place_s = (actor.captured_ns - shift_ns - start_ns) / 1e9
    return [encoded("place", pm.PlaceUpdate(place_s, actor.frame - shift_frames))]


def _summary(path: Path) -> Summary | None:
    """Summary of a take; None where its index is lost, or the take cannot be read, which the replay reports."""
    try:
        return read_summary(path)
    except OSError:
        return None


def _pose_s(path: Path) -> float:
    """Time from one pose of a take to the next; 0 where the take does not have it."""
    try:
        rig = setup_of(path)
    except (UserError, OSError):  # the replay reports it
        return 0.0
    return 0.0 if rig is None else rig.frame_ns() / 1e9
