"""What the page is shown of the animator's state, and how often: poses as they come, the rest at the pace of an eye."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from common import messages as m
from services.animator.page.hub import Piece
from services.animator.page.news import checks, news, rows, views
from services.animator.snapshot import Actor, Source
from services.animator.states import State

VIEWS_NS = 60_000_000  # between two pictures of the silhouettes
POSED_NS = 500_000_000  # for so long after a pose the next one is waited for, so that it fits the silhouettes
ROWS_NS = 250_000_000
CHECKS_NS = 500_000_000


@dataclass(frozen=True)
class Shown:
    """What was shown last, and when, by the state's own time.  silhouettes, actors: in the last views."""

    state: State = field(default_factory=State)
    silhouettes: Mapping[str, m.Silhouette] = field(default_factory=dict)
    actors: Mapping[Source, Actor] = field(default_factory=dict)
    views_ns: int = 0
    rows_ns: int = 0
    checks_ns: int = 0


def show(shown: Shown, state: State, pages: int) -> tuple[Shown, list[Piece]]:
    """The pieces that are due.  pages: how many are open."""
    if state is shown.state:
        return shown, []
    pieces = list(news(shown.state, state))
    silhouettes, actors = shown.silhouettes, shown.actors
    views_ns, rows_ns, checks_ns = shown.views_ns, shown.rows_ns, shown.checks_ns
    if state.now_ns - views_ns >= VIEWS_NS and _views_changed(shown, state):
        views_ns, silhouettes, actors = state.now_ns, state.silhouettes, state.actors
        pieces += views(state)
    if state.now_ns - rows_ns >= ROWS_NS:
        rows_ns = state.now_ns
        pieces.append(rows(state, pages))
    if state.now_ns - checks_ns >= CHECKS_NS:
        checks_ns = state.now_ns
        pieces.append(checks(state))
    return Shown(state, silhouettes, actors, views_ns, rows_ns, checks_ns), pieces


def _views_changed(shown: Shown, state: State) -> bool:
    """Whether there is a new pose in the silhouettes, or a new silhouette where no poses come."""
    posed = any(state.now_ns - actor.received_ns < POSED_NS for actor in state.actors.values())
    return state.actors is not shown.actors if posed else state.silhouettes is not shown.silhouettes
