"""Sections of an evaluation report: tables and pictures, written as Markdown, CSV and JSON."""

import csv
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

Cell = str | int | float
Row = tuple[Cell, ...]


@dataclass(frozen=True)
class Table:
    """columns: the first holds names.  Floats are printed with one decimal."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[Row, ...]


@dataclass(frozen=True)
class Section:
    """One section of a report.  notes: what was measured and how.  pictures: files in the same folder."""

    name: str
    title: str
    notes: tuple[str, ...]
    tables: tuple[Table, ...]
    pictures: tuple[str, ...] = field(default=())


def markdown(table: Table) -> str:
    lines = [
        "| " + " | ".join(table.columns) + " |",
        "|" + "---|" + "---:|" * (len(table.columns) - 1),
        *("| " + " | ".join(text(cell) for cell in row) + " |" for row in table.rows),
    ]
    return "\n".join([f"**{table.title}**", "", *lines, ""])


def text(cell: Cell) -> str:
    if isinstance(cell, float):
        return f"{cell:.1f}" if math.isfinite(cell) else "–"
    return str(cell)


def write(section: Section, out: Path) -> None:
    """Write the section as JSON, CSV and Markdown files."""
    out.mkdir(parents=True, exist_ok=True)
    plain = {
        "name": section.name,
        "title": section.title,
        "notes": section.notes,
        "tables": [
            {"title": t.title, "columns": t.columns, "rows": [list(map(_finite, row)) for row in t.rows]}
            for t in section.tables
        ],
        "pictures": section.pictures,
    }
    (out / f"{section.name}.json").write_text(json.dumps(plain, indent=1) + "\n")
    for number, table in enumerate(section.tables, 1):
        with (out / f"{section.name}-{number}.csv").open("w", newline="") as file:
            csv.writer(file).writerows([table.columns, *table.rows])
    body = [f"## {section.title}", "", *(f"{note}\n" for note in section.notes), *map(markdown, section.tables)]
    body += [f"![{picture}]({picture})\n" for picture in section.pictures]
    (out / f"{section.name}.md").write_text("\n".join(body))


def report(out: Path, names: Sequence[str], title: str) -> Path:
    """Write one page of the existing sections, in the order of `names`; return its path."""
    pages = [(out / f"{name}.md").read_text() for name in names if (out / f"{name}.md").is_file()]
    path = out / "report.md"
    path.write_text("\n".join([f"# {title}\n", *pages]))
    return path


def _finite(cell: Cell) -> Cell | None:
    return None if isinstance(cell, float) and not math.isfinite(cell) else cell
