"""Labels of takes as rows of a manifest, with undo; a refused change leaves everything as it was."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import islice
from pathlib import Path

from zenocap.common.errors import UserError
from zenocap.services.recognizer.training.examples import BACKGROUND, LONGEST_LABEL
from zenocap.services.recognizer.training.manifest import ManifestRow
from zenocap.services.recognizer.training.parameters import LEAST_BACKGROUND_S
from zenocap.tools.teach.page.parameters import LEAST_LABEL_S, MOST_UNDONE

DIGITS = 3  # after the point, seconds: those of a manifest
EXACT_S = 1e-6
MOST_SOURCES = 4096  # paths whose files are remembered; chosen by hand


@dataclass(frozen=True)
class Label:
    """A row of the manifest.  id: stays with it while it is changed."""

    id: int
    row: ManifestRow


@dataclass(frozen=True)
class TakeSpan:
    """What a label may cover.  start_s, end_s: of the take, seconds.  check: raises ValueError for a span without poses."""

    source: Path
    start_s: float
    end_s: float
    check: Callable[[float, float], object]


Labels = tuple[Label, ...]


def labels_of(rows: Sequence[ManifestRow]) -> Labels:
    return tuple(Label(k, row) for k, row in enumerate(rows))


def add(labels: Labels, span: TakeSpan, start_s: float, end_s: float, posture: str, person: str) -> Labels:
    """Add a label, numbered as the next repetition of its posture by its person.  Raises UserError."""
    row = _checked(labels, span, ManifestRow(0, span.source, start_s, end_s, posture, person, ""), None)
    number = max((one.id for one in labels), default=-1) + 1
    return (*labels, Label(number, _numbered(labels, row)))


def change(labels: Labels, span: TakeSpan, id: int, start_s: float, end_s: float, posture: str) -> Labels:
    """Change begin, end and posture of a label.  Raises UserError."""
    one = find(labels, id)
    others = tuple(other for other in labels if other.id != id)
    row = _checked(others, span, replace(one.row, start=start_s, end=end_s, posture=posture), id)
    if row.posture != one.row.posture:
        row = _numbered(others, row)
    return tuple(replace(other, row=row) if other.id == id else other for other in labels)


def remove(labels: Labels, id: int) -> Labels:
    """Remove a label.  Raises UserError."""
    find(labels, id)
    return tuple(one for one in labels if one.id != id)


def rename_person(labels: Labels, source: Path, person: str) -> Labels:
    """Set the person, a checked text, of all labels of a take."""
    changed: Labels = tuple(one for one in labels if not same(one.row.source, source))
    for one in labels:
        if same(one.row.source, source):
            changed = (*changed, replace(one, row=_numbered(changed, replace(one.row, person=person))))
    order = {one.id: k for k, one in enumerate(labels)}
    return tuple(sorted(changed, key=lambda one: order[one.id]))


def find(labels: Labels, id: int) -> Label:
    """The label of an id.  Raises UserError."""
    found = next((one for one in labels if one.id == id), None)
    if found is None:
        raise UserError("this label was deleted meanwhile")
    return found


def overlaps(labels: Labels) -> list[tuple[Label, Label]]:
    """Pairs of labels of one take that overlap; rows without begin or end reach to the end of the take."""
    found: list[tuple[Label, Label]] = []
    by_take: dict[Path, list[Label]] = {}
    for one in sorted(labels, key=lambda one: one.row.start or 0.0):
        by_take.setdefault(_resolved(one.row.source), []).append(one)
    for every in by_take.values():
        for k, one in enumerate(every):
            end_s = float("inf") if one.row.end is None else one.row.end
            for other in islice(every, k + 1, None):
                if (other.row.start or 0.0) >= end_s:
                    break
                if _shared_s(one.row, other.row) > EXACT_S:
                    found.append((one, other))
    return found


def checked_text(key: str, text: str) -> str:
    """The text without space at its ends.  Raises UserError for one that a manifest cannot have."""
    text = text.strip()
    if not 1 <= len(text) <= LONGEST_LABEL or not text.isprintable():
        raise UserError(f"{key} = {text!r}: allowed: 1 to {LONGEST_LABEL} printable characters")
    return text


def same(one: Path, other: Path) -> bool:
    """Whether two paths are the same file."""
    return _resolved(one) == _resolved(other)


@lru_cache(MOST_SOURCES)
def _resolved(path: Path) -> Path:
    """The file of a path; thousands of labels are compared by it."""
    return path.resolve()


def _checked(others: Labels, span: TakeSpan, row: ManifestRow, id: int | None) -> ManifestRow:
    """The row with rounded times.  Raises UserError."""
    posture = checked_text("posture", row.posture)
    assert row.start is not None
    assert row.end is not None
    start_s, end_s = round(row.start, DIGITS), round(row.end, DIGITS)
    row = replace(row, posture=posture, start=start_s, end=end_s)
    least = LEAST_BACKGROUND_S if posture == BACKGROUND else LEAST_LABEL_S
    if end_s - start_s < least - EXACT_S:
        what = "background" if posture == BACKGROUND else "a label"
        raise UserError(f"{start_s:.2f} to {end_s:.2f} s: allowed for {what}: {least:g} s or more")
    if start_s < span.start_s - 10**-DIGITS or end_s > span.end_s + 10**-DIGITS:
        raise UserError(
            f"{start_s:.2f} to {end_s:.2f} s: allowed: within the take, {span.start_s:.2f} to {span.end_s:.2f} s"
        )
    for other in others:
        if same(other.row.source, row.source) and _shared_s(other.row, row) > EXACT_S:
            name = "background" if other.row.posture == BACKGROUND else other.row.posture
            begin_s = other.row.start or 0.0
            until = "the end" if other.row.end is None else f"{other.row.end:.2f} s"
            raise UserError(
                f"{start_s:.2f} to {end_s:.2f} s overlaps {name!r}, {begin_s:.2f} s to {until}: "
                "allowed: labels beside each other"
            )
    if posture != BACKGROUND:
        try:
            span.check(start_s, end_s)
        except ValueError as error:
            raise UserError(f"{start_s:.2f} to {end_s:.2f} s: {error}") from None
    return row


def _shared_s(one: ManifestRow, other: ManifestRow) -> float:
    end = min(float("inf") if row.end is None else row.end for row in (one, other))
    return end - max(one.start or 0.0, other.start or 0.0)


def _numbered(labels: Labels, row: ManifestRow) -> ManifestRow:
    """The row with the repetition after the largest one of its posture by its person."""
    done = [one.row for one in labels if (one.row.posture, one.row.person) == (row.posture, row.person)]
    numbers = [int(one.repetition) for one in done if one.repetition.isdecimal()]
    return replace(row, repetition=str(max([len(done), *numbers]) + 1))


@dataclass(frozen=True)
class History:
    """Labels now, before, and those that were undone; the latest last."""

    now: Labels
    before: tuple[Labels, ...] = ()
    undone: tuple[Labels, ...] = ()

    def changed(self, labels: Labels) -> "History":
        """The history after a change."""
        return History(labels, (*self.before, self.now)[-MOST_UNDONE:])

    def undo(self) -> "History":
        """The history before the last change.  Raises UserError without one."""
        if not self.before:
            raise UserError("nothing to undo")
        return History(self.before[-1], self.before[:-1], (*self.undone, self.now))

    def redo(self) -> "History":
        """The history before the last undo.  Raises UserError without one."""
        if not self.undone:
            raise UserError("nothing to redo")
        return History(self.undone[-1], (*self.before, self.now), self.undone[:-1])
