"""A page: updates to all browsers that show it, and their commands in the order in which they came."""

import logging
import queue
import time
from collections.abc import Callable, Iterator

import msgspec

from zenocap.common.errors import UserError
from zenocap.common.rig.animator import PageTable
from zenocap.common.runtime.foreign_text import printable
from zenocap.common.web.broadcast import PageQueue, encoded
from zenocap.common.web.content import PageContent
from zenocap.common.web.messages import C, NoticeUpdate
from zenocap.common.web.parameters import MOST_COMMANDS
from zenocap.common.web.server import PageServer, listening_problem

logger = logging.getLogger(__name__)
NOTICE = "notice"  # key of a line of text for the user
MOST_REASON = 200  # characters of the reason of a failure that a notice has; chosen by hand


def _never(page: PageQueue, command: object) -> bool:
    return False


class Page(PageServer[C]):
    """Served from `open` to `close`.

    direct: is called with each command in the server's thread and returns whether that is all; other commands wait for
    `commands`.  Raises ValueError with the reason for one that is refused.
    wake: is called in the server's thread when a command waits, and when a page opens while none was open.
    openings: how often the latter happened: the full state must then be published again.
    """

    def __init__(
        self, table: PageTable, content: PageContent[C], direct: Callable[[PageQueue, C], bool] = _never,
        wake: Callable[[], None] = lambda: None,
    ) -> None:  # fmt: skip
        self._direct, self._wake = direct, wake
        self._commands: queue.Queue[C] = queue.Queue(MOST_COMMANDS)
        self.openings = 0
        super().__init__(table, self._receive, self._first_page_opened, content)

    @property
    def pages(self) -> int:
        """Number of open pages."""
        return self.updates.pages

    def open(self) -> None:
        """Serve the page.  Raises UserError when the port is not available."""
        table, content = self._table, self._content
        try:
            self.listen()
        except (OSError, UnicodeError) as error:
            option = f"{content.options}port"
            allowed = option if option == "--port" else f"{option} (or --port)"
            raise UserError(
                f"{content.options.rstrip('.-') or 'page'}: {table.host}:{table.port} cannot be served: "
                f"{listening_problem(error)}: another program, such as a second {content.program}, may use the port; "
                f"allowed: another {allowed}, or 0 for any free one"
            ) from error

    def publish(self, key: str, update: msgspec.Struct, feed: str | None = None) -> None:
        """Send an update to all pages that show a feed; to all pages for None.  Pages that open later get no old notice."""
        self.updates.publish(feed, [encoded(key, update)], kept=key != NOTICE)

    def notice(self, text: str) -> None:
        """Show a line of text on all open pages."""
        self.publish(NOTICE, NoticeUpdate(text))

    def commands(self) -> Iterator[C]:
        """The commands that wait now; those that come meanwhile are left for the next call, so that a flood ends."""
        for _ in range(self._commands.qsize()):
            yield self._commands.get()

    def run(
        self, stopped: Callable[[], bool], handle: Callable[[C], None], turn: Callable[[], bool], pause_s: float
    ) -> None:
        """Handle commands and call `turn` until `stopped`; there is a pause where neither had anything to do.

        A command that is refused, or fails, gives a notice, and the page goes on.
        """
        while not stopped():
            busy = False
            for command in self.commands():
                if stopped():
                    return
                self._handled(handle, command)
                busy = True
            if not (turn() or busy):
                time.sleep(pause_s)

    def _handled(self, handle: Callable[[C], None], command: C) -> None:
        try:
            handle(command)
        except UserError as error:
            self.notice(str(error))
        except Exception as error:  # the page must not end by one command
            logger.exception("%s: failed", type(command).__name__)
            self.notice(f"{type(command).__name__}: failed: {printable(str(error))[:MOST_REASON]}")

    def _first_page_opened(self) -> None:
        self.openings += 1
        self._wake()

    def _receive(self, page: PageQueue, command: C) -> None:
        if self._direct(page, command):
            return
        try:
            self._commands.put_nowait(command)
        except queue.Full:
            raise ValueError("refused: too many commands wait") from None
        self._wake()
