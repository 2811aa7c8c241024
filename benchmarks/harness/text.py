"""Figures as text, and tables of results for the terminal and for pages."""

from collections.abc import Sequence

from rich.console import Console
from rich.measure import Measurement
from rich.table import Table

from benchmarks.harness.results import HOLDS, Heading, Results, Row

NONE = "–"
WIDEST = 1000  # characters


def cell(row: Row, heading: Heading) -> str:
    """A figure with the worst seed's in brackets; in square brackets the seeds that have none."""
    values = row.figures.get(heading.name, [])
    if not values:
        return ""
    if heading.name == HOLDS:
        return "yes" if values[-1] else "NO"
    texts = [NONE if value is None else f"{value:.{heading.digits}f}" for value in values]
    worst = f" ({texts[1]})" if len(texts) > 1 and texts[1] != texts[0] else ""
    missing = row.missing.get(heading.name, 0)
    return f"{texts[0]}{worst}" + (f" [{missing} of {row.seeds} without]" if missing and texts[0] != NONE else "")


def title(heading: Heading) -> str:
    return f"{heading.name}, {heading.unit}" if heading.unit else heading.name


def markdown(results: Results, rows: Sequence[Row], headings: Sequence[Heading]) -> str:
    """Table of a page, columns that are empty left out, and a line on where the figures come from."""
    shown = [one for one in headings if any(cell(row, one) for row in rows)]
    rows = [row for row in rows if any(cell(row, one) for one in shown)]
    lines = [
        f"| {results.rows} | " + " | ".join(map(title, shown)) + " |",
        "|---|" + "--:|" * len(shown),
        *(f"| {row.case} | " + " | ".join(cell(row, one) for one in shown) + " |" for row in rows),
    ]
    return "\n".join([*lines, "", *sources(rows)])


def across(results: Results, rows: Sequence[Row], heading: Heading) -> str:
    """Table of one column of the results, in which the last part of the names of the cases goes across."""
    rows = [row for row in rows if ", " in row.case and cell(row, heading)]
    cells = {tuple(row.case.rsplit(", ", 1)): cell(row, heading) for row in rows}
    columns = list(dict.fromkeys(last for _, last in cells))
    lines = [
        f"| {results.rows.rsplit(', ', 1)[0]}: {title(heading)} | " + " | ".join(columns) + " |",
        "|---|" + "--:|" * len(columns),
        *(
            f"| {first} | " + " | ".join(cells.get((first, last), "") for last in columns) + " |"
            for first in dict.fromkeys(first for first, _ in cells)
        ),
    ]
    return "\n".join([*lines, "", *sources(rows)])


def sources(rows: Sequence[Row]) -> list[str]:
    """A line for each origin of the rows: command, commit and date, machine of what is timed."""
    found: dict[str, int] = {}
    for row in rows:
        seeds = f", {row.seeds} seeds" if row.seeds > 1 else ""
        machine = f", {row.machine}" if row.machine else ""
        text = f"`{row.command}`, commit {row.commit}, {row.date}{seeds}{machine}"
        found[text] = found.get(text, 0) + 1
    several = len(found) > 1
    rows_of = {text: f" ({count} row{'s' * (count > 1)})" if several else "" for text, count in found.items()}
    return [f"*{text}{count}.*" for text, count in rows_of.items()]


def show(results: Results, rows: Sequence[Row], console: Console) -> None:
    """Print the table, on longer lines than the terminal's where it is wider."""
    table = Table(title=results.kind, title_justify="left")
    shown = [one for one in results.columns if any(cell(row, one) for row in rows)]
    table.add_column(results.rows)
    for one in shown:
        table.add_column(title(one), justify="right")
    for row in rows:
        table.add_row(row.case, *(cell(row, one) for one in shown))
    console.print(results.about)
    options = console.options.update(max_width=WIDEST)
    console.width = max(console.width, Measurement.get(console, options, table).maximum)
    console.print(table)
