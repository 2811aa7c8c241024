"""Takes on the animator's page: played ones, dropped ones, and files saved of them for other programs."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from zenocap.common.rig.animator import PageTable
from zenocap.common.web.broadcast import PageQueue
from zenocap.common.web.content import PageContent, Socket, page_files
from zenocap.common.web.page import Page
from zenocap.services.animator.page import page_messages as pm
from zenocap.services.animator.page.drop_receiver import DropReceiver
from zenocap.services.animator.page.save_messages import CancelSaving
from zenocap.services.animator.parameters import MAX_DROPPED_PIECE
from zenocap.services.animator.save_job import SaveJob

if TYPE_CHECKING:  # loaded by its users, once the page is served: its imports take most of a second
    from zenocap.services.animator.playback import TakePlayer

DROP_PATH = "/drop"


class TakeFeed:
    """The animator's page, from `open` to `close`.  player: None until it is set.

    direct, wake: see `Page`.  on_drop: called with the path of a dropped take, in the server's thread.  niceness: of the
    process that saves a file.
    """

    def __init__(
        self,
        table: PageTable,
        direct: Callable[[PageQueue, pm.Command], bool],
        on_drop: Callable[[Path], None],
        wake: Callable[[], None] = lambda: None,
        niceness: int = 0,
    ) -> None:
        self._drops = DropReceiver(on_drop)
        sockets = {DROP_PATH: Socket(self._drops.receive, MAX_DROPPED_PIECE)}
        content: PageContent[pm.Command] = PageContent(
            page_files("zenocap.services.animator.page"), pm.decode_command, "animator", "animator.page.", sockets,
            feeds=get_args(pm.Feed),
        )  # fmt: skip
        self.page = Page(table, content, direct, wake)
        self.player: TakePlayer | None = None
        self.saving = SaveJob(lambda update: self.page.publish("saving", update), self.page.offered.offer, niceness)

    def open(self, hello: pm.HelloUpdate) -> None:
        """Serve the page.  Raises UserError."""
        self.page.open()
        self.page.publish("hello", hello)

    def close(self) -> None:
        self.saving.close()
        if self.player is not None:
            self.player.close()
        self.page.close()
        self._drops.close()

    def receive(self, page: PageQueue, command: pm.Command) -> bool:
        """Handle a command that every page on a take has; returns whether it was one."""
        match command:
            case pm.SelectFeed(feed=feed):
                self.page.updates.select_feed(page, feed)
            case pm.ControlPlayer() if self.player is not None:
                self.player.send(command)
            case CancelSaving():
                self.saving.cancel()
            case _:
                return False
        return True
