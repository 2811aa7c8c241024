"""Results as text, Markdown and JSON."""

from collections.abc import Sequence

import msgspec

from benchmarks.faults.run import Outcome, Result
from benchmarks.table import Cell, table

COLUMNS = (
    "fault", "others' frames", "poses", "of all viewers", "longest gap, s", "recovered after, s", "frames lost", "later",
)  # fmt: skip


def rows(results: Sequence[Result]) -> list[list[str]]:
    """One row of COLUMNS per fault."""
    return [_row(result) for result in results]


def _row(result: Result) -> list[str]:
    found = result.figures
    if found is None:
        return [result.fault, *["-"] * 4, "never", "-", "-"]
    lost = ", ".join(f"{viewer}: {count}" for viewer, count in found.lost.items()) or "0"
    recovered = "never" if found.recovered_s is None else f"{found.recovered_s:.1f}"
    shares = [f"{share:.0%}" for share in (found.others, found.poses, found.whole)]
    return [result.fault, *shares, f"{found.gap_s:.1f}", recovered, lost, str(found.after_lost)]


def as_text(outcome: Outcome) -> str:
    starts: list[list[Cell]] = [[one.method, ", ".join(one.order), one.seconds] for one in outcome.started]
    logs: list[list[Cell]] = [[log.name, log.equal, log.different, log.unchecked, log.remark] for log in outcome.logs]
    return "\n".join(
        (
            table("Started in any order", ["method", "order", "first poses, s"], starts),
            table("Faults: during the fault and afterwards", COLUMNS, rows(outcome.results)),
            table("The logs, recomputed", ["take", "equal", "different", "unchecked", "remark"], logs),
        )
    )


def as_markdown(outcome: Outcome) -> str:
    lines = [f"| {' | '.join(COLUMNS)} |", "|---" * len(COLUMNS) + "|"]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows(outcome.results))]) + "\n"


def as_json(outcome: Outcome) -> str:
    return msgspec.json.format(msgspec.json.encode(outcome), indent=1).decode()
