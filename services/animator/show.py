"""`zenocap show`: the page on one recorded take, without a rig."""

import logging
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from zenocap.common.errors import UserError
from zenocap.common.recording.reader import TakeReader
from zenocap.common.recording.summary import read_summary
from zenocap.common.rig.animator import PageTable
from zenocap.common.runtime.clock import RealClock
from zenocap.common.runtime.service_info import versions
from zenocap.common.web.broadcast import PageQueue
from zenocap.common.web.messages import NoticeUpdate
from zenocap.services.animator.page import page_messages as pm
from zenocap.services.animator.page.save_messages import SaveTake
from zenocap.services.animator.parameters import POSED_S, SHOW_POLL_S
from zenocap.services.animator.picture_feed import PictureFeed, Pictures
from zenocap.services.animator.save_command import format_choices
from zenocap.services.animator.states import TOPICS, ActorPose
from zenocap.services.animator.take_feed import TakeFeed

if TYPE_CHECKING:  # loaded where they are needed: their imports take longer than those of the rest
    from zenocap.services.animator.comparison import TakeComparison
    from zenocap.services.animator.comparison_reader import ComparisonReader, Stopped

logger = logging.getLogger(__name__)
READING = "the second take is being read; it appears when both are compared"
NO_RIG = "this page shows one take, without a rig: commands to a rig are not available"


class TakePage:
    """Page that plays one take in a loop, from `open` to `close`.  raw: with the poses of the forward pass.

    pictures: of the cameras at a time of the take; None without videos.  compared: reads the comparison with a second take
    (see `comparison_reader.compare`) while the page is served; None without one.  player: its latest state.
    """

    def __init__(
        self,
        take: Path,
        table: PageTable,
        pictures: Pictures | None = None,
        *,
        raw: bool = False,
        compared: "Callable[[Stopped], TakeComparison] | None" = None,
    ) -> None:
        self._reader: ComparisonReader | None = None
        if compared is not None:
            from zenocap.services.animator import comparison_reader as reading

            # The second take is shown in place of the notice that it is read.
            self._reader = reading.ComparisonReader(compared, lambda found: self._feed.page.publish("ghost", found.body()))
        self._start_ns = 0
        self._take, self._raw, self._pictures = take, raw, pictures
        self._camera_feed: PictureFeed | None = None
        self._dropped: Path | None = None  # take that is shown instead
        self._switching = False  # to another take: the end of the one before is no end of the page
        self._feed = TakeFeed(table, self._direct, self._on_drop)
        self.player, self._posed_s = pm.PlayerUpdate(take.name), 0.0

    @property
    def address(self) -> str:
        """URL of the page."""
        return self._feed.page.address

    @property
    def problem(self) -> str:
        """Reason that the second take cannot be compared, "" otherwise."""
        return "" if self._reader is None else self._reader.problem

    def open(self) -> None:
        """Serve the page and start to play.  Raises UserError."""
        self._feed.open(_hello(self._take))
        from zenocap.services.animator.playback import TakePlayer  # takes most of a second, in which a page is loaded

        summary, updates = read_summary(self._take), self._feed.page.updates
        self._start_ns = 0 if summary is None else summary.start_ns
        if self._pictures is not None and summary is not None:
            self._camera_feed = PictureFeed(self._pictures, summary.start_ns, updates)
        self._feed.player = TakePlayer(
            self._take.parent, updates, RealClock(), TOPICS, self._on_update, self._on_pose, raw=self._raw
        )
        self._feed.player.send(pm.PlayTake(self._take.name))
        if self._reader is not None:
            self._feed.page.publish("ghost", NoticeUpdate(READING))
            self._reader.start()

    def close(self) -> None:
        if self._reader is not None:
            self._reader.close()
        if self._camera_feed is not None:
            self._camera_feed.close()
        self._feed.close()

    def _on_drop(self, path: Path) -> None:
        """Show a dropped take instead of the take of the page."""
        from zenocap.services.animator.playback import PlayFile

        if self._feed.player is None:
            self._feed.page.publish(
                "dropped", pm.DroppedUpdate(problem=f"{path.name}: the page is being opened; drop it again")
            )
            return
        self._dropped = path
        self._switch(path, pm.DroppedUpdate(path.name))
        self._feed.player.send(PlayFile(path))

    def _show_own(self, problem: str = "") -> None:
        """Show the take of the page again.  problem: why the dropped one could not be played."""
        assert self._feed.player is not None
        self._dropped = None
        self._switch(self._take, pm.DroppedUpdate(problem=problem))
        self._feed.player.send(pm.PlayTake(self._take.name))

    def _switch(self, take: Path, dropped: pm.DroppedUpdate) -> None:
        self._switching = True
        self._feed.page.publish("dropped", dropped)
        self._feed.page.publish("hello", _hello(take))

    def _on_update(self, update: pm.PlayerUpdate) -> None:
        if self._dropped is not None:
            if not update.take and update.problem:
                self._show_own(update.problem)
            return
        if self._switching and not (update.take or update.problem):
            return
        self._switching = False
        self.player = update
        moves = not update.paused and time.monotonic() - self._posed_s < POSED_S
        if self._camera_feed is not None and update.take and not moves:
            self._camera_feed.show(update.position_s)

    def _on_pose(self, actor: ActorPose, shift_ns: int) -> None:
        """Pictures follow the poses while the take plays, so that both are of one time."""
        if self._dropped is not None:
            return
        self._posed_s = time.monotonic()
        position_s = (actor.captured_ns - shift_ns - self._start_ns) / 1e9
        if self._camera_feed is not None and not self.player.paused and 0 <= position_s <= self.player.duration_s:
            self._camera_feed.show(position_s, self.player.rate)
        comparison = None if self._reader is None else self._reader.found
        ghost = None if comparison is None else comparison.at(actor, shift_ns)
        if ghost is not None:
            self._feed.page.publish("ghost_pose", ghost, "take")

    def _direct(self, page: PageQueue, command: pm.Command) -> bool:
        """Handle a command of a page in the server's thread.  Raises ValueError."""
        match command:
            case pm.ControlPlayer(stop=True):
                if self._dropped is None:
                    raise ValueError(NO_RIG)
                self._show_own()
            case SaveTake():
                take = self._dropped or self._take
                self._feed.saving.start(command, take, take.parent, raw=self._raw, kept=self._dropped is None)
            case _:
                if not self._feed.receive(page, command):
                    raise ValueError(NO_RIG)
        return True


def _hello(take: Path) -> pm.HelloUpdate:
    return pm.HelloUpdate(take.stem, "take", versions()["zenocap"], [], live=False, formats=format_choices())


def check_take(take: Path) -> None:
    """Raise UserError for a file that does not exist or is no take."""
    if not take.is_file():
        raise UserError(f"{take}: no such file")
    next(TakeReader(take).messages(), None)


def show_take(
    take: Path,
    table: PageTable,
    stopped: Callable[[], bool],
    on_open: Callable[[str], None],
    pictures: Pictures | None = None,
    *,
    raw: bool = False,
    compared: "Callable[[Stopped], TakeComparison] | None" = None,
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
