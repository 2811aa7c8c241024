"""Display of the rig's status: a live table on a terminal, elsewhere one plain line per second."""

import re
from collections.abc import Sequence

from rich.console import Group
from rich.table import Table
from rich.text import Text

from zenocap.common.messages import Phase
from zenocap.common.observe.losses import lost as lost_of
from zenocap.common.rig.services import ServiceKey, title
from zenocap.common.runtime.foreign_text import printable
from zenocap.tools.record.launcher.rig_status import RigStatus, lost_text, posture_label, view_of

WIDE = 120  # columns of a terminal, from which the stage times and the states in full are shown; chosen by hand
TIMES = "stage times, ms"
HEADINGS = ("service", "frames/s", TIMES, "dropped", "view", "score", "state")
# Stages of the services that run once per frame; their median times are shown.
STAGES = (
    ("step_frame", "silhouette + place"), ("step_assignment", "limbs"), ("step_sighting", "assign"),
    ("step_partial_bap", "pose"), ("step_tick", "follow"), ("result_age", "since capture"),
)  # fmt: skip


def table(status: RigStatus, services: Sequence[ServiceKey], elapsed_s: float, take: str, width: int = WIDE) -> Group:
    """The whole display: the address of the page, a line for each service, the pose, the take.  width: of the terminal.

    Below WIDE columns there are no stage times, the state is that of the phase, in two words, and nothing is wrapped.
    """
    wide = width >= WIDE
    page = _page_of(status, services)
    head = Text(f"zenocap  {elapsed_s:.0f} s    {f'page: {page}    ' if page else ''}Ctrl-C ends", style="bold")
    rows = Table(expand=False)
    shown = [heading for heading in HEADINGS if wide or heading != TIMES]
    for heading in shown:
        rows.add_column(
            heading, justify="right" if heading in ("frames/s", "dropped", "score") else "left", no_wrap=not wide
        )
    for service in services:
        cells = dict(zip(HEADINGS, _row(status, service, wide), strict=True))
        rows.add_row(*(cells[heading] for heading in shown))
    lines = [head, *_pose_lines(status, wide), *_posture_line(status), Text(f"take: {printable(take)}", style="dim")]
    for line in lines if not wide else ():
        line.no_wrap, line.overflow = True, "ellipsis"
    return Group(lines[0], rows, *lines[1:])


def _page_of(status: RigStatus, services: Sequence[ServiceKey]) -> str:
    """Address of the page, which the animator states; empty before, and without a page."""
    for service in services:
        health = status.services.health.get(service)
        if service[0] == "animator" and health is not None:
            found = re.search(r"page (https?://[^\s,]+)", health.state)
            return printable(found[1]) if found else ""
    return ""


def plain_line(status: RigStatus, services: Sequence[ServiceKey], elapsed_s: float) -> str:
    parts = [f"{elapsed_s:5.1f} s"]
    for service in services:
        health = status.services.health.get(service)
        if service not in status.services.alive or health is None:
            parts.append(f"{title(service)}: not running")
            continue
        view, score = _view(status, service)
        seen = f" {view} {score}".rstrip()
        parts.append(f"{title(service)}: {health.rate:.1f}/s{seen} {printable(health.state)}")
    angles = ", ".join(f"{name} {value}°" for name, value in status.angles().items())
    if status.posture is not None:
        parts.append(f"posture: {posture_label(status.posture)}")
    if status.pose is not None:
        parts.append(f"frame {status.pose.frame}: {angles}" + (f" ({lost})" if (lost := lost_text(status.pose)) else ""))
    return " | ".join(parts)


def _row(status: RigStatus, service: ServiceKey, wide: bool) -> list[str | Text]:
    """Cells of HEADINGS.  wide: with the state as the service describes it."""
    health = status.services.health.get(service)
    if service not in status.services.alive:
        return [title(service), "", "", "", "", "", Text("not running" if health else "starting", style="yellow")]
    if health is None:
        return [title(service), "", "", "", "", "", "starting"]
    view, score = _view(status, service)
    words = health.state if wide or health.phase is Phase.UNKNOWN else health.phase.replace("_", " ")
    lost, rate, state = lost_of(health.counts), f"{health.rate:.1f}", Text(printable(words))
    times = "  ".join(f"{label} {health.stages_ms[stage]:.1f}" for stage, label in STAGES if stage in health.stages_ms)
    return [title(service), rate, times, Text(str(lost), style="red" if lost else ""), view, score, state]


def _view(status: RigStatus, service: ServiceKey) -> tuple[str, str]:
    name, id = service
    view, score = view_of(status.pose, id) if name == "viewer" else ("", None)
    return view, "" if score is None else f"{score:.2f}"


def _posture_line(status: RigStatus) -> list[Text]:
    if status.posture is None:
        return []
    duration_s = (status.posture.end_ns - status.posture.start_ns) / 1e9
    return [Text(f"posture: {posture_label(status.posture)}, {duration_s:.1f} s, margin {status.posture.margin:.2f}")]


def _pose_lines(status: RigStatus, wide: bool) -> list[Text]:
    """Frame, place, angles and what is lost."""
    if status.pose is None:
        return [Text("no pose yet: the body is measured when all viewers see a T-pose")]
    line = Text("frame {}   navel at {:+.2f} {:+.2f} {:+.2f} m".format(status.pose.frame, *status.pose.position))
    digits, between = (4, "   ") if wide else (0, "  ")
    angles = Text(between.join(f"{name} {value:{digits}d}°" for name, value in status.angles().items()))
    parts = [line, *([angles] if wide else []), Text(lost_text(status.pose), style="yellow")]
    return [Text("   ").join(filter(None, parts)), *([] if wide else [angles])]
