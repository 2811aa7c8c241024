"""Manifest of examples: a CSV file with one row per posture.

A row with `labels` instead of a posture names a label table of its source: one example for each span of equal labels.
"""

import csv
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from zenocap.common.atomic_write import atomic_file
from zenocap.common.errors import UserError
from zenocap.common.formats.import_format import import_suffixes
from zenocap.services.recognizer.training.examples import LONGEST_LABEL
from zenocap.services.recognizer.training.label_table import LONGEST_S, read_spans, read_table, seconds_of

COLUMNS = ("source", "start", "end", "posture", "person", "repetition")
LABELS = "labels"  # further column
INSTEAD = ("start", "end", "posture", "repetition")  # of labels
SOURCE_NAMES = ("source", "take", "clip", "file")  # accepted names of the first column
RIG = ".toml"
MOST_ALIKE = 3  # errors that differ in numbers, values and files only and are all listed; chosen by hand
VARIES = re.compile(r"'[^']*'|\S*[/\\]\S*|\S+\.(?:mcap|bvh|trc|c3d|toml)\b|\d+(?:\.\d+)?")


@dataclass(frozen=True)
class ManifestRow:
    """One example.  line: in the manifest.  source: a motion file, or a rig file or clip folder to be tracked first.

    start, end: seconds from the start of the source; None: its start and end.
    """

    line: int
    source: Path
    start: float | None
    end: float | None
    posture: str
    person: str
    repetition: str

    @property
    def is_rig(self) -> bool:
        return self.source.suffix.lower() == RIG or self.source.is_dir()

    def __str__(self) -> str:
        return self.text(Path())

    def text(self, base: Path) -> str:
        """The row in words.  base: folder of the manifest, to which the source is relative."""
        span = "" if self.start is None and self.end is None else f" from {_seconds(self.start)} to {_seconds(self.end)}"
        return f"line {self.line}: {relative(self.source, base)}{span}"


def relative(source: Path, base: Path) -> Path:
    """The source relative to a folder that contains it; any other as it is."""
    return source.relative_to(base) if source.is_relative_to(base) else source


def summarized(errors: Sequence[str]) -> list[str]:
    """Errors in order; of more than MOST_ALIKE of one kind only the first, with their number."""
    kinds = [VARIES.sub("#", error) for error in errors]
    counts, first = Counter(kinds), {kind: number for number, kind in reversed(list(enumerate(kinds)))}
    lines = []
    for number, (kind, error) in enumerate(zip(kinds, errors, strict=True)):
        alike = counts[kind]
        if alike <= MOST_ALIKE:
            lines.append(error)
        elif first[kind] == number:
            lines.append(f"{error} (and {alike - 1} more of this kind)")
    return lines


def read_manifest(path: Path) -> list[ManifestRow]:
    """Read the rows of a manifest, in order; sources are relative to its folder.

    Cells are separated by commas, semicolons or tabs; the first line names the columns in any order.
    Without a person column all examples count as one person's; missing repetitions are numbered.  Raises UserError with
    all errors, not only the first.
    """
    wrong: list[str] = []
    first, names, lines = read_table(path, wrong)
    if not first.strip():
        raise UserError(f"{path}: line 1: empty: allowed: the columns {','.join(COLUMNS)}")
    columns = _columns(path, names)
    rows: list[ManifestRow] = []
    counts = Counter[tuple[str, str]]()
    for number, cells in lines:
        rows += _rows(_ManifestLine(path, number, columns, cells, wrong), counts)
    wrong += _repeated(path, rows)
    if wrong:
        raise UserError("\n".join(summarized(wrong)))
    if not rows:
        raise UserError(f"{path}: no rows after the first line: allowed: one or more per posture")
    return rows


def write_manifest(path: Path, rows: Iterable[ManifestRow]) -> None:
    """Write a manifest atomically; sources inside its folder are written relative to it.  Raises OSError."""
    base = path.parent.resolve()
    with atomic_file(path) as unfinished, unfinished.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for row in rows:
            span = ["" if value is None else f"{value:.3f}" for value in (row.start, row.end)]
            shown = relative(row.source.resolve(), base).as_posix()
            writer.writerow([shown, *span, row.posture, row.person, row.repetition])


def _columns(path: Path, names: Sequence[str]) -> Mapping[str, int]:
    plain = ["source" if name in SOURCE_NAMES else name for name in names]
    known = (*COLUMNS, LABELS)
    wrong = [f"column {name!r}" for name in plain if name not in known]
    wrong += [f"column {name!r} more than once" for name in known if plain.count(name) > 1]
    wrong += [] if "source" in plain else ["no column 'source'"]
    wrong += [] if "posture" in plain or LABELS in plain else ["no column 'posture'"]
    if wrong:
        needed = "needed: source, and posture or labels"
        raise UserError(f"{path}: line 1: {', '.join(wrong)}: allowed: {', '.join(known)}; {needed}")
    return {name: k for k, name in enumerate(plain)}


@dataclass(frozen=True)
class _ManifestLine:
    """The cells of a line of a manifest; what is wrong with them is added to `wrong`."""

    path: Path
    number: int
    columns: Mapping[str, int]
    cells: Sequence[str]
    wrong: list[str]

    def refuse(self, column: str, value: str, allowed: str) -> None:
        self.wrong.append(f"{self.path}: line {self.number}: {column} = {value!r}: allowed: {allowed}")

    def cell(self, column: str) -> str:
        at = self.columns.get(column, len(self.cells))
        return self.cells[at].strip() if at < len(self.cells) else ""

    def seconds(self, column: str) -> float | None:
        text = self.cell(column)
        value = seconds_of(text)
        if text and value is None:
            self.refuse(column, text, f"seconds from the start of the source, 0 to {LONGEST_S:g}, or empty")
        return value

    def source(self) -> Path:
        text, motions = self.cell("source"), (".mcap", *import_suffixes())
        source = self.path.parent / text
        try:
            exists = source.exists()
        except (OSError, ValueError) as error:  # a name that is too long, or has a zero byte
            self.refuse("source", text[:80], f"a file or folder that exists: {getattr(error, 'strerror', None) or error}")
            return source
        if not text:
            self.refuse("source", "", f"a file ({', '.join(motions)}), a rig file ({RIG}) or a clip folder")
        elif not exists:
            self.refuse("source", text, f"a file or folder that exists; there is no {source}")
        elif source.is_file() and source.suffix.lower() not in (*motions, RIG):
            self.refuse("source", text, f"{', '.join(motions)}, a rig file ({RIG}) or a clip folder")
        return source

    def span(self) -> tuple[float | None, float | None]:
        start, end = self.seconds("start"), self.seconds("end")
        if end is not None and end <= (start or 0.0):
            self.refuse("end", self.cell("end"), f"seconds after start = {start or 0.0:g}")
        return start, end

    def check_labels(self, values: Mapping[str, str]) -> None:
        for column, value in values.items():
            least = 0 if column == "repetition" or self.cell(LABELS) else 1
            if not least <= len(value) <= LONGEST_LABEL or not value.isprintable():
                self.refuse(column, value, f"{least} to {LONGEST_LABEL} printable characters")


def _rows(line: _ManifestLine, counts: Counter[tuple[str, str]]) -> list[ManifestRow]:
    """The example of a line, or those of its label table; none where something is wrong."""
    before, labels = len(line.wrong), line.cell(LABELS)
    if len(line.cells) > len(line.columns):
        allowed = f"{len(line.columns)}, as the first line has"
        line.wrong.append(f"{line.path}: line {line.number}: {len(line.cells)} cells: allowed: {allowed}")
    source = line.source()
    for column in INSTEAD if labels else ():
        if line.cell(column):
            line.refuse(column, line.cell(column), "an empty cell beside labels")
    start, end = line.span()
    posture, person = line.cell("posture"), line.cell("person") or "1"
    line.check_labels({"posture": posture, "person": person, "repetition": line.cell("repetition")})
    spans = [(start, end, posture)]
    if labels:
        try:
            spans = [(span.start, span.end, span.label) for span in read_spans(line.path.parent / labels)]
        except UserError as error:
            line.wrong.extend(str(error).splitlines())
    if len(line.wrong) > before:
        return []
    rows = []
    for begin, until, label in spans:
        counts[label, person] += 1
        repetition = line.cell("repetition") or str(counts[label, person])
        rows.append(ManifestRow(line.number, source, begin, until, label, person, repetition))
    return rows


def _repeated(path: Path, rows: Sequence[ManifestRow]) -> list[str]:
    """Errors of rows with the same span of the same source as an earlier row."""
    first: dict[tuple[Path, float | None, float | None], ManifestRow] = {}
    wrong = []
    for row in rows:
        earlier = first.setdefault((row.source.resolve(), row.start, row.end), row)
        if earlier is not row:
            same = f"the same span of {relative(row.source, path.parent)} as line {earlier.line}"
            wrong.append(f"{path}: line {row.line}: {same}: allowed: every span of a source once")
    return wrong


def _seconds(value: float | None) -> str:
    return "start or end" if value is None else f"{value:g} s"
