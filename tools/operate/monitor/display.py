"""Display of the network as a table on a terminal, and as JSON."""

from collections.abc import Sequence

from rich.console import Group
from rich.table import Table
from rich.text import Text

from zenocap.common.bus.certificate import WARNED_DAYS
from zenocap.common.observe.view import TROUBLE, ObservedService
from zenocap.common.runtime.foreign_text import printable

BLOCKS = "▁▂▃▄▅▆▇█"
QUARTER_FRAME_MS = 8.0  # at 30 frames/s; larger clock offsets are highlighted
HEADINGS = (
    "service", "", "rate/s", "", "latency ms", "longest step ms", "lost", "clock ms", "MB", "cores", "busy", "state",
)  # fmt: skip
LEFT = ("service", "", "longest step ms", "state")
STYLES = {"up": "green", "starting": "yellow", "silent": "red", "gone": "red", "missing": "red"}


def shown(rows: Sequence[ObservedService], foot: str) -> Group:
    """One table per rig.  foot: the last line."""
    rigs = list(dict.fromkeys(row.rig for row in rows))
    tables = [_table(rig, [row for row in rows if row.rig == rig]) for rig in rigs]
    return Group(*tables, *([] if tables else [Text("no service found", style="yellow")]), Text(foot, style="dim"))


def _table(rig: str, rows: Sequence[ObservedService]) -> Table:
    up, cores = sum(row.status == "up" for row in rows), sum(row.cores for row in rows)
    memory = sum(row.memory_mb for row in rows)
    title = f"{printable(rig)}: {up} of {len(rows)} up, {cores:.2f} cores, {memory:.0f} MB"
    table = Table(title=Text(title), title_justify="left", expand=False)
    secured = any(row.certificate_days is not None for row in rows)
    for heading in (*HEADINGS[:-1], "cert days", HEADINGS[-1]) if secured else HEADINGS:
        left = heading in LEFT
        table.add_column(heading, justify="left" if left else "right", no_wrap=heading != "state", overflow="ellipsis")
    for row in rows:
        table.add_row(*_cells(row, secured=secured), style="red" if row.status in TROUBLE else "")
    return table


def _cells(row: ObservedService, *, secured: bool) -> list[str | Text]:
    """secured: whether there is a column for the certificates."""
    status, title = Text(row.status, style=STYLES[row.status]), Text(printable(row.title))
    if row.status in ("missing", "starting"):
        return [title, status]
    lost = Text(f"{row.lost}" + (f" +{row.lately}" if row.lately else ""), style="red" if row.lately else "")
    return [
        title, status, f"{row.rate:.1f}", sparkline(row.rates), _number(row.latency_ms), Text(printable(row.stage)), lost,
        _clock(row),
        f"{row.memory_mb:.0f}", f"{row.cores:.2f}", Text(f"{row.busy:.0%}", style="red" if row.busy > 0.9 else ""),
        *([_days(row.certificate_days)] if secured else []),
        Text(printable(words(row)), style="yellow" if row.advice else ""),
    ]  # fmt: skip


def words(row: ObservedService) -> str:
    """State of a service, after the faults of its camera's images."""
    return f"! {row.advice} | {row.words}" if row.advice else row.words


def _days(days: int | None) -> Text:
    return Text("" if days is None else f"{days}", style="red" if days is not None and days <= WARNED_DAYS else "")


def sparkline(values: Sequence[float], length: int = 10) -> str:
    """The last `length` values as bars, scaled from 0 to the largest."""
    last = values[-length:]
    most = max(last, default=0.0)
    if most <= 0:
        return BLOCKS[0] * len(last)
    return "".join(BLOCKS[min(len(BLOCKS) - 1, int(value / most * (len(BLOCKS) - 1) + 0.5))] for value in last)


def _clock(row: ObservedService) -> Text:
    if row.offset_ms is None or row.error_ms is None:
        return Text("")
    far = abs(row.offset_ms) - row.error_ms > QUARTER_FRAME_MS
    return Text(f"{row.offset_ms:+.1f} ±{row.error_ms:.1f}", style="red" if far else "")


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.1f}"


def as_json(rows: Sequence[ObservedService]) -> dict[str, object]:
    """One object: `services`, each with every field of its row."""
    return {"services": [{name: value for name, value in vars(row).items() if name != "rates"} for row in rows]}
