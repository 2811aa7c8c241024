"""What the page is shown of the animator's state, and how often: poses as they come, the rest at the pace of an eye."""

from dataclasses import dataclass, field

from services.animator.page.hub import Piece
from services.animator.page.news import checks, news, rows, views
from services.animator.states import State

VIEWS_NS = 60_000_000  # between two pictures of the silhouettes
ROWS_NS = 250_000_000
CHECKS_NS = 500_000_000


@dataclass(frozen=True)
class Shown:
    """What was shown last, and when, by the state's own time."""

    state: State = field(default_factory=State)
    views_ns: int = 0
    rows_ns: int = 0
    checks_ns: int = 0


def show(shown: Shown, state: State, pages: int) -> tuple[Shown, list[Piece]]:
    """The pieces that are due.  pages: how many are open."""
    if state is shown.state:
        return shown, []
    pieces = list(news(shown.state, state))
    views_ns, rows_ns, checks_ns = shown.views_ns, shown.rows_ns, shown.checks_ns
    if state.now_ns - views_ns >= VIEWS_NS and state.silhouettes != shown.state.silhouettes:
        views_ns = state.now_ns
        pieces += views(state)
    if state.now_ns - rows_ns >= ROWS_NS:
        rows_ns = state.now_ns
        pieces.append(rows(state, pages))
    if state.now_ns - checks_ns >= CHECKS_NS:
        checks_ns = state.now_ns
        pieces.append(checks(state))
    return Shown(state, views_ns, rows_ns, checks_ns), pieces
