"""Figures that are stored in the repository, one JSON file a kind."""

import subprocess
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from os import cpu_count
from pathlib import Path

import msgspec

from benchmarks.harness.cache import ROOT, source_digest
from benchmarks.harness.case import Figures, Kind
from zenocap.common.errors import UserError
from zenocap.common.processor import processor

FOLDER = ROOT / "benchmarks" / "results"
WRITTEN = ("benchmarks/results", "docs", "README.md")  # by --publish and --pictures: no result depends on them
HOLDS = "holds"  # column of 1 and 0: whether all limits of a case do; where they do not, the command fails


class Heading(msgspec.Struct, frozen=True):
    """name, unit and digits of a column."""

    name: str
    unit: str = ""
    digits: int = 1


class Row(msgspec.Struct, frozen=True, omit_defaults=True):
    """Figures of one case.

    figures: by column, the joined figure, and the worst seed's where there are several.  missing: seeds without that
    figure.
    commit, date, command: with which they were measured.  machine: of what is timed.  sources: see `source_digest`; "" for
    figures from before there was one.
    """

    case: str
    figures: dict[str, list[float | None]]
    seeds: int
    commit: str
    date: str
    command: str
    missing: dict[str, int] = {}
    machine: str = ""
    sources: str = ""


class Results(msgspec.Struct, frozen=True):
    """Content of a file.  about, rows, columns: of the kind, so that pages are written without its code."""

    kind: str
    about: str
    rows: str
    columns: tuple[Heading, ...]
    figures: tuple[Row, ...] = ()

    def row(self, case: str) -> Row:
        """The latest row of a case.  Raises UserError."""
        found = [row for row in self.figures if row.case == case]
        if not found:
            raise UserError(f"{self.kind}: no result of {case!r}: allowed: {', '.join(row.case for row in self.figures)}")
        return max(found, key=lambda row: row.date)

    def heading(self, name: str) -> Heading:
        """Column of that name.  Raises UserError."""
        found = {one.name: one for one in self.columns}
        if name not in found:
            raise UserError(f"{self.kind}: no column {name!r}: allowed: {', '.join(found)}")
        return found[name]


def summary(name: str, kind: Kind, runs: Sequence[Figures], sources: str) -> Row:
    """Row of one case from the runs of its seeds, of this commit and machine."""
    by_column = {column: [run.get(column.name, float("nan")) for run in runs] for column in kind.columns}
    measured = {column: values for column, values in by_column.items() if any(value == value for value in values)}
    return Row(
        name,
        {column.name: column.summary(values) for column, values in measured.items()},
        len(runs),
        commit(),
        datetime.now(UTC).date().isoformat(),
        f"python -m benchmarks {kind.name}",
        {column.name: n for column, values in measured.items() if (n := sum(value != value for value in values))},
        f"{processor()}, {cpu_count()} cores" if kind.timed else "",
        sources,
    )


def commit() -> str:
    """Short commit of the checkout, with `-dirty` where files differ from it that are not written here; "" without git."""
    head = _git("rev-parse", "--short", "HEAD")
    changed = _git("status", "--porcelain", "--untracked-files=no", "--", ".", *(f":!{name}" for name in WRITTEN))
    return f"{head}-dirty" if head and changed else head


def _git(*arguments: str) -> str:
    """Standard output of git; "" where it fails."""
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=False)
    return done.stdout.strip() if done.returncode == 0 else ""


def store(kind: Kind, rows: Sequence[Row]) -> None:
    """Put rows into the file of a kind in place of those of the same case and machine; cases that are gone go."""
    path = FOLDER / f"{kind.name}.json"
    before = load(path).figures if path.is_file() else ()
    replaced = {(row.case, row.machine) for row in rows} | {(row.case, "") for row in rows}
    order = list(kind.cases)
    kept = [row for row in before if (row.case, row.machine) not in replaced and row.case in order]
    found = tuple(sorted([*kept, *rows], key=lambda row: order.index(row.case)))
    write(results_of(kind, found))


def stale(found: Results, kind: Kind) -> Iterator[str]:
    """A line for each row whose sources are others now, or are not known."""
    for row in found.figures:
        one = kind.cases.get(row.case)
        measured = f"commit {row.commit}, {row.date}"
        if not row.sources:
            yield f"{kind.name}: {row.case}: before digests: {measured}"
        elif one is None or source_digest(kind, one) != row.sources:
            yield f"{kind.name}: {row.case}: sources changed since {measured}"


def results_of(kind: Kind, rows: Sequence[Row]) -> Results:
    columns = tuple(Heading(one.name, one.unit, one.digits) for one in kind.columns)
    return Results(kind.name, kind.about, kind.rows, columns, tuple(rows))


def write(results: Results) -> None:
    """One row a line, so that a difference shows what was renewed."""
    head = msgspec.structs.replace(results, figures=())
    lines = [msgspec.json.encode(row).decode() for row in results.figures]
    text = msgspec.json.encode(head).decode().removesuffix("[]}") + "[\n" + ",\n".join(lines) + "\n]}\n"
    FOLDER.mkdir(parents=True, exist_ok=True)
    (FOLDER / f"{results.kind}.json").write_text(text, encoding="utf-8")


def load(path: Path) -> Results:
    """Content of a file.  Raises UserError that names a damaged file."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=Results)
    except (OSError, msgspec.DecodeError) as error:
        raise UserError(f"{path}: no results of a benchmark: {error}") from error


def load_all() -> Mapping[str, Results]:
    """All results, by kind.  Raises UserError."""
    return {path.stem: load(path) for path in sorted(FOLDER.glob("*.json"))}
