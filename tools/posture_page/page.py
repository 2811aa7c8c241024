"""The page on which postures are taught: its server, and the loop that handles its commands."""

import queue
import time
from collections.abc import Callable, Sequence
from functools import lru_cache

import msgspec

from zenocap.common.errors import UserError
from zenocap.common.rig.animator import PageTable
from zenocap.common.web.broadcast import PageQueue, encoded
from zenocap.common.web.server import PageContent, PageServer, page_files
from zenocap.tools.posture_page import messages as pm
from zenocap.tools.posture_page.motion_view import MotionView
from zenocap.tools.posture_page.parameters import MOST_COMMANDS, POLL_S
from zenocap.tools.posture_page.session import Publish, Session

PROGRAM = "zenocap posture label"
CACHED_CHUNKS = 64  # of poses, in memory: 8 MB; chosen by hand


class PosturePage:
    """Serves the page from `open` to `close`; `run` between them."""

    def __init__(self, takes: Sequence[MotionView], make_session: Callable[[Publish], Session], table: PageTable) -> None:
        content: PageContent[pm.Command] = PageContent(
            page_files("zenocap.tools.posture_page"), pm.decode_command, PROGRAM, "--"
        )
        self._takes = takes
        self._server = PageServer(table, self._receive, lambda: None, content)
        self._commands: queue.Queue[pm.Command] = queue.Queue(MOST_COMMANDS)
        self._chunk = lru_cache(CACHED_CHUNKS)(lambda take, number: takes[take].chunk(number))
        self._pages = 0
        self.session = make_session(self._publish)

    @property
    def address(self) -> str:
        """URL of the page, token included."""
        return self._server.address

    def open(self) -> None:
        """Serve the page.  Raises UserError."""
        self._server.start()
        self.session.open()

    def close(self) -> None:
        self.session.close()
        self._server.close()

    def run(self, stopped: Callable[[], bool]) -> None:
        """Run until `stopped`."""
        while not stopped():
            if not self.turn():
                time.sleep(POLL_S)

    def turn(self) -> bool:
        """Handle what waits; returns whether there was anything."""
        busy = self.session.turn()
        while not self._commands.empty():
            self.session.receive(self._commands.get())
            busy = True
        if (pages := self._server.broadcaster.pages) != self._pages:
            self._pages = pages
            self._publish("pages", pm.PagesUpdate(pages))
        return busy

    def _receive(self, page: PageQueue, command: pm.Command) -> None:
        """Called by the server's thread.  Raises ValueError."""
        if isinstance(command, pm.AskPoses):
            if command.take >= len(self._takes):
                raise ValueError(f"take {command.take}: allowed: 0 to {len(self._takes) - 1}")
            update = pm.PosesUpdate(command.take, command.chunk, self._chunk(command.take, command.chunk))
            page.put(encoded(f"poses/{command.take}/{command.chunk}", update))
            return
        try:
            self._commands.put_nowait(command)
        except queue.Full:
            raise ValueError("refused: too many commands wait") from None

    def _publish(self, key: str, update: msgspec.Struct) -> None:
        self._server.broadcaster.publish(None, [encoded(key, update)])


def run_page(page: PosturePage, stopped: Callable[[], bool], on_open: Callable[[str], None]) -> None:
    """Serve until `stopped`.  on_open: called with the address.  Raises UserError."""
    try:
        page.open()
        on_open(page.address)
        page.run(stopped)
    except OSError as error:
        raise UserError(f"the page: {error.strerror or error}") from error
    finally:
        page.close()
