"""`zenocap show`: the page on one recorded take, without a rig."""

import logging
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from zenocap.common.errors import UserError
from zenocap.common.recording.reader import Take
from zenocap.common.recording.summary import read_summary
from zenocap.common.rig.animator import PageTable
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.service_info import versions
from zenocap.services.animator.page import page_messages as pm
from zenocap.services.animator.page.broadcast import EncodedUpdate, PageQueue
from zenocap.services.animator.page.drop_receiver import DropReceiver
from zenocap.services.animator.page.save_messages import CancelSaving, SaveTake, SavingUpdate
from zenocap.services.animator.page.server import PageServer, animator_content
from zenocap.services.animator.parameters import POSED_S, SHOW_POLL_S
from zenocap.services.animator.picture_feed import PictureFeed, Pictures
from zenocap.services.animator.save_job import SaveJob
from zenocap.services.animator.states import Actor
from zenocap.services.animator.topics import TOPICS

if TYPE_CHECKING:  # loaded where they are needed: their imports take longer than those of the rest
    from zenocap.services.animator.comparison import Comparison
    from zenocap.services.animator.comparison_reader import ComparisonReader, Stopped
    from zenocap.services.animator.playback import Playback

logger = logging.getLogger(__name__)


class TakePage:
    """Page that plays one take in a loop, from `open` to `close`.  raw: with the poses of the forward pass.

    pictures: of the cameras at a time of the take; None without videos.  compared: reads the comparison with a second take
    (see `comparison_reader.compare`) while the page is served; None without one.
    """

    def __init__(
        self,
        take: Path,
        table: PageTable,
        pictures: Pictures | None = None,
        *,
        raw: bool = False,
        compared: "Callable[[Stopped], Comparison] | None" = None,
    ) -> None:
        self._reader = None if compared is None else _reader(compared, self._on_comparison)
        self._start_ns = 0
        self._take, self._raw, self._pictures = take, raw, pictures
        self._feed: PictureFeed | None = None
        self._dropped: Path | None = None  # take that is shown instead
        self._switching = False  # to another take: the end of the one before is no end of the page
        drops = DropReceiver(self._on_drop)
        self._server = PageServer(table, self._receive, lambda: None, animator_content(), drops)
        self._player, self._posed_s = pm.PlayerUpdate(take.name), 0.0
        self._playback: Playback | None = None
        self._saving = SaveJob(self._on_saving, self._server.offered.offer)

    @property
    def address(self) -> str:
        """URL of the page."""
        return self._server.address

    @property
    def player(self) -> pm.PlayerUpdate:
        """Latest state of the player."""
        return self._player

    @property
    def problem(self) -> str:
        """Reason that the second take cannot be compared, "" otherwise."""
        return "" if self._reader is None else self._reader.problem

    def open(self) -> None:
        """Serve the page and start to play.  Raises UserError."""
        self._server.start()
        self._publish("hello", pm.HelloUpdate(self._take.stem, "take", versions()["zenocap"], [], live=False))
        from zenocap.services.animator.playback import Playback  # takes most of a second, in which a page is loaded

        summary = read_summary(self._take)
        self._start_ns = 0 if summary is None else summary.start_ns
        if self._pictures is not None and summary is not None:
            self._feed = PictureFeed(self._pictures, summary.start_ns, self._server.broadcaster)
        self._playback = Playback(
            self._take.parent, self._server.broadcaster, RealClock(), TOPICS, self._on_update, self._on_pose, raw=self._raw
        )
        self._playback.send(pm.PlayTake(self._take.name))
        if self._reader is not None:
            self._publish("ghost", pm.NoticeUpdate("the second take is being read; it appears when both are compared"))
            self._reader.start()

    def close(self) -> None:
        if self._reader is not None:
            self._reader.close()
        self._saving.close()
        if self._playback is not None:
            self._playback.close()
        if self._feed is not None:
            self._feed.close()
        self._server.close()

    def _publish(self, key: str, update: pm.Update) -> None:
        self._server.broadcaster.publish(None, [EncodedUpdate(key, pm.encode(update))])

    def _on_drop(self, path: Path) -> None:
        """Show a dropped take instead of the take of the page."""
        from zenocap.services.animator.playback import PlayFile

        if self._playback is None:
            self._publish("dropped", pm.DroppedUpdate(problem=f"{path.name}: the page is being opened; drop it again"))
            return
        self._dropped, self._switching = path, True
        self._publish("dropped", pm.DroppedUpdate(path.name))
        self._publish("hello", pm.HelloUpdate(path.stem, "take", versions()["zenocap"], [], live=False))
        self._playback.send(PlayFile(path))

    def _show_own(self, problem: str = "") -> None:
        """Show the take of the page again.  problem: why the dropped one could not be played."""
        assert self._playback is not None
        self._dropped, self._switching = None, True
        self._publish("dropped", pm.DroppedUpdate(problem=problem))
        self._publish("hello", pm.HelloUpdate(self._take.stem, "take", versions()["zenocap"], [], live=False))
        self._playback.send(pm.PlayTake(self._take.name))

    def _on_update(self, update: pm.PlayerUpdate) -> None:
        if self._dropped is not None:
            if not update.take and update.problem:
                self._show_own(update.problem)
            return
        if self._switching and not (update.take or update.problem):
            return
        self._switching = False
        self._player = update
        moves = not update.paused and time.monotonic() - self._posed_s < POSED_S
        if self._feed is not None and update.take and not moves:
            self._feed.show(update.position_s)

    def _on_pose(self, actor: Actor, shift_ns: int) -> None:
        """Pictures follow the poses while the take plays, so that both are of one time."""
        if self._dropped is not None:
            return
        self._posed_s = time.monotonic()
        position_s = (actor.captured_ns - shift_ns - self._start_ns) / 1e9
        if self._feed is not None and not self._player.paused and 0 <= position_s <= self._player.duration_s:
            self._feed.show(position_s, self._player.rate)
        comparison = None if self._reader is None else self._reader.found
        ghost = None if comparison is None else comparison.at(actor, shift_ns)
        if ghost is not None:
            self._server.broadcaster.publish("take", [EncodedUpdate("ghost_pose", pm.encode(ghost))])

    def _on_comparison(self, comparison: "Comparison") -> None:
        """Show the second take, in place of the notice that it is read."""
        self._publish("ghost", comparison.body())

    def _on_saving(self, update: SavingUpdate) -> None:
        self._publish("saving", update)

    def _receive(self, page: PageQueue, command: pm.Command) -> None:
        match command:
            case pm.SelectFeed(feed=feed):
                self._server.broadcaster.select_feed(page, feed)
            case pm.ControlPlayer(stop=True) if self._dropped is not None:
                self._show_own()
            case pm.ControlPlayer(stop=False) if self._playback is not None:
                self._playback.send(command)
            case SaveTake():
                take = self._dropped or self._take
                self._saving.start(command, take, take.parent, raw=self._raw, kept=self._dropped is None)
            case CancelSaving():
                self._saving.cancel()
            case _:
                raise ValueError("this page shows one take, without a rig: commands to a rig are not available")


def _reader(
    compared: "Callable[[Stopped], Comparison]", on_comparison: "Callable[[Comparison], None]"
) -> "ComparisonReader":
    from zenocap.services.animator.comparison_reader import ComparisonReader

    return ComparisonReader(compared, on_comparison)


def check_take(take: Path) -> None:
    """Raise UserError for a file that does not exist or is no take."""
    if not take.is_file():
        raise UserError(f"{take}: no such file")
    next(Take(take).messages(), None)


def show_take(
    take: Path,
    table: PageTable,
    stopped: Callable[[], bool],
    on_open: Callable[[str], None],
    pictures: Pictures | None = None,
    *,
    raw: bool = False,
    compared: "Callable[[Stopped], Comparison] | None" = None,
) -> None:
    """Show a take until `stopped`.  on_open: called with the address of the page.  The others: see `TakePage`.

    Raises UserError.
    """
    check_take(take)
    page = TakePage(take.resolve(), table, pictures, raw=raw, compared=compared)
    page.open()
    try:
        on_open(page.address)
        warned = ""
        while not stopped():
            player = page.player
            if page.problem:
                raise UserError(page.problem)
            if not player.take:
                raise UserError(player.problem or f"{take}: the replay has ended")
            if player.problem and player.problem != warned:
                warned = player.problem
                logger.warning("%s: %s", take, warned)
            time.sleep(SHOW_POLL_S)
    finally:
        page.close()
