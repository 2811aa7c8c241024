"""The board on a terminal as a live table, elsewhere as one plain line a second."""

from collections.abc import Sequence

from rich.console import Group
from rich.table import Table
from rich.text import Text

from common import messages as m
from services.launcher.board import Board, Service, lost_words, posture_words, title, view_of

# Counts that a person should know of; the rest stands in the take.
LOSSES = (
    "dropped_frames", "dropped_instants", "dropped_queue_full", "rejected_invalid", "step_errors", "unsendable",
    "log_lost",
)  # fmt: skip

# What a service does on which event, every frame.
STAGES = (
    ("step_frame", "silhouette + place"), ("step_assignment", "limbs"), ("step_sighting", "assign"),
    ("step_partial_bap", "pose"), ("step_tick", "follow"), ("result_age", "since capture"),
)  # fmt: skip


def table(board: Board, services: Sequence[Service], elapsed_s: float, take: str) -> Group:
    """The whole display."""
    rows = Table(title=f"zenocap  {elapsed_s:.0f} s", title_justify="left", expand=False)
    for heading in ("service", "frames/s", "stage times, ms", "dropped", "view", "score", "state"):
        rows.add_column(heading, justify="right" if heading in ("frames/s", "dropped", "score") else "left")
    for service in services:
        rows.add_row(*_row(board, service))
    return Group(rows, _pose_line(board), *_posture_line(board), Text(f"take: {take}    Ctrl-C ends", style="dim"))


def plain_line(board: Board, services: Sequence[Service], elapsed_s: float) -> str:
    """The same in one line."""
    parts = [f"{elapsed_s:5.1f} s"]
    for service in services:
        health = board.health.get(service)
        if service not in board.alive or health is None:
            parts.append(f"{title(service)}: not there")
            continue
        view, score = _view(board, service)
        seen = f" {view} {score}".rstrip()
        parts.append(f"{title(service)}: {health.rate:.1f}/s{seen} {health.state}")
    angles = ", ".join(f"{name} {value}°" for name, value in board.angles().items())
    if board.posture is not None:
        parts.append(f"posture: {posture_words(board.posture)}")
    if board.pose is not None:
        trouble = lost_words(board.pose)
        parts.append(f"frame {board.pose.frame}: {angles}" + (f" ({trouble})" if trouble else ""))
    return " | ".join(parts)


def _row(board: Board, service: Service) -> list[str | Text]:
    health = board.health.get(service)
    if service not in board.alive:
        return [title(service), "", "", "", "", "", Text("not there" if health else "starting", style="yellow")]
    if health is None:
        return [title(service), "", "", "", "", "", "starting"]
    view, score = _view(board, service)
    lost = dropped(health)
    return [
        title(service),
        f"{health.rate:.1f}",
        stage_times(health),
        Text(str(lost), style="red" if lost else ""),
        view,
        score,
        health.state,
    ]


def stage_times(health: m.Health) -> str:
    """Medians of what is done for every frame."""
    shown = ((words, health.stages_ms.get(stage)) for stage, words in STAGES)
    return "  ".join(f"{words} {ms:.1f}" for words, ms in shown if ms is not None)


def dropped(health: m.Health) -> int:
    return sum(health.counts.get(name, 0) for name in LOSSES)


def _view(board: Board, service: Service) -> tuple[str, str]:
    name, id = service
    view, score = view_of(board.pose, id) if name == "viewer" else ("", None)
    return view, "" if score is None else f"{score:.2f}"


def _posture_line(board: Board) -> list[Text]:
    if board.posture is None:
        return []
    lasted_s = (board.posture.end_ns - board.posture.start_ns) / 1e9
    return [Text(f"posture: {posture_words(board.posture)}, {lasted_s:.1f} s, margin {board.posture.margin:.2f}")]


def _pose_line(board: Board) -> Text:
    if board.pose is None:
        return Text("no pose yet: the body is measured when all viewers see the initial posture, arms sideways")
    x, y, z = board.pose.position
    angles = "   ".join(f"{name} {value:4d}°" for name, value in board.angles().items())
    line = Text(f"frame {board.pose.frame}   navel at {x:+.2f} {y:+.2f} {z:+.2f} m   {angles}")
    trouble = lost_words(board.pose)
    return line.append(f"   {trouble}", style="yellow") if trouble else line
