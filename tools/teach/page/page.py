"""The page on which postures are taught: its server, and the loop that handles its commands."""

from collections.abc import Callable, Sequence
from functools import lru_cache

from zenocap.common.errors import UserError
from zenocap.common.rig.animator import PageTable
from zenocap.common.web.broadcast import PageQueue, encoded
from zenocap.common.web.content import PageContent, page_files
from zenocap.common.web.page import Page
from zenocap.tools.teach.page import messages as pm
from zenocap.tools.teach.page.motion_view import MotionView
from zenocap.tools.teach.page.parameters import POLL_S
from zenocap.tools.teach.page.session import Publish, TeachingSession

PROGRAM = "zenocap posture label"
POSES = "poses/"  # key of a chunk
MOST_POSES = 16  # chunks that wait for one page, which asks for two at a time; chosen by hand
CACHED_CHUNKS = 64  # of poses, in memory: 8 MB; chosen by hand


class PosturePage:
    """Serves the page from `open` to `close`; `run` between them."""

    def __init__(
        self, takes: Sequence[MotionView], make_session: Callable[[Publish], TeachingSession], table: PageTable
    ) -> None:
        files = page_files("zenocap.tools.teach.page")
        content: PageContent[pm.Command] = PageContent(files, pm.decode_command, PROGRAM, "--")
        self._takes = takes
        self._page = Page(table, content, self._send_poses)
        self._chunk = lru_cache(CACHED_CHUNKS)(lambda take, number: takes[take].chunk(number))
        self._pages = 0
        self.session = make_session(self._page.publish)

    @property
    def address(self) -> str:
        """URL of the page, token included."""
        return self._page.address

    def open(self) -> None:
        """Serve the page.  Raises UserError."""
        self._page.open()
        self.session.open()

    def close(self) -> None:
        self.session.close()
        self._page.close()

    def run(self, stopped: Callable[[], bool]) -> None:
        self._page.run(stopped, self.session.receive, self._turn, POLL_S)

    def _turn(self) -> bool:
        """Handle what has finished; returns whether there was anything."""
        if (pages := self._page.pages) != self._pages:
            self._pages = pages
            self._page.publish("pages", pm.PagesUpdate(pages))
        return self.session.turn()

    def _send_poses(self, page: PageQueue, command: pm.Command) -> bool:
        """In the server's thread: poses for one page.  Raises ValueError."""
        if not isinstance(command, pm.AskPoses):
            return False
        if command.take >= len(self._takes):
            raise ValueError(f"take {command.take}: allowed: 0 to {len(self._takes) - 1}")
        if command.chunk >= (chunks := self._takes[command.take].chunks):
            raise ValueError(f"chunk {command.chunk}: allowed: 0 to {chunks - 1}")
        if sum(key.startswith(POSES) for key in page.waiting) >= MOST_POSES:
            raise ValueError("refused: too many poses wait to be received")
        update = pm.PosesUpdate(command.take, command.chunk, self._chunk(command.take, command.chunk))
        page.put(encoded(f"{POSES}{command.take}/{command.chunk}", update))
        return True


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
