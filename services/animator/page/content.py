"""What the animator serves: the page, and the socket of dropped takes."""

from zenocap.common.web.server import PageContent, Socket, page_files
from zenocap.services.animator.page.drop_receiver import DropReceiver
from zenocap.services.animator.page.page_messages import FEEDS, Command, decode_command
from zenocap.services.animator.parameters import MAX_DROPPED_PIECE

DROP_PATH = "/drop"


def animator_content(drops: DropReceiver) -> PageContent[Command]:
    """The page of the animator.  drops: receives files that are dropped on it."""
    files, sockets = page_files("zenocap.services.animator.page"), {DROP_PATH: Socket(drops.receive, MAX_DROPPED_PIECE)}
    return PageContent(files, decode_command, "animator", "animator.page.", sockets, FEEDS)
