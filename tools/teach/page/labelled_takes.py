"""Open takes and their labels, saved at once: commands that change them, and their update."""

from collections.abc import Sequence
from dataclasses import replace

from zenocap.common.errors import UserError
from zenocap.services.recognizer.training.example_files import span
from zenocap.services.recognizer.training.examples import BACKGROUND
from zenocap.services.recognizer.training.manifest import ManifestRow
from zenocap.tools.teach.page import labels as lb
from zenocap.tools.teach.page import messages as pm
from zenocap.tools.teach.page.manifest_file import ManifestFile
from zenocap.tools.teach.page.motion_view import MotionView

LabelCommand = pm.AddLabel | pm.ChangeLabel | pm.DeleteLabel | pm.SetPerson | pm.Undo


class LabelledTakes:
    """Takes, and the labels of a manifest.  person: of takes without a label.  Raises UserError."""

    def __init__(self, takes: Sequence[MotionView], file: ManifestFile, person: str) -> None:
        self.takes, self.file = tuple(takes), file
        self._history = lb.History(lb.labels_of(file.read()))
        self._people = [self._person_of(take, person) for take in self.takes]
        self._spans = [_span_of(take) for take in self.takes]

    @property
    def labels(self) -> lb.Labels:
        """All labels of the manifest."""
        return self._history.now

    @property
    def rows(self) -> list[ManifestRow]:
        return [one.row for one in self._history.now]

    def labels_in(self, take: int) -> list[tuple[int, ManifestRow]]:
        """Id and row of the labels of a take."""
        return [(one.id, one.row) for one in self._history.now if self._take_of(one.row, -1) == take]

    def end_s(self, take: int) -> float:
        return self._spans[take].end_s

    def checked(self, take: int) -> int:
        """The number of a take.  Raises UserError for one that is not open."""
        if take >= len(self.takes):
            raise UserError(f"take {take}: allowed: 0 to {len(self.takes) - 1}")
        return take

    def handle(self, command: LabelCommand) -> bool:
        """Do what a command asks and save it; returns whether the labels have changed.

        Raises UserError, and nothing has changed.
        """
        now = self._history.now
        match command:
            case pm.AddLabel(take=take, start_s=start_s, end_s=end_s, posture=posture):
                person = self._people[self.checked(take)]
                self._change(lb.add(now, self._spans[take], start_s, end_s, posture, person))
            case pm.ChangeLabel(id=id, start_s=start_s, end_s=end_s, posture=posture):
                span = self._spans[self._take_of(lb.find(now, id).row)]
                self._change(lb.change(now, span, id, start_s, end_s, posture))
            case pm.DeleteLabel(id=id):
                self._change(lb.remove(now, id))
            case pm.SetPerson(take=take, person=person):
                return self._set_person(self.checked(take), lb.checked_text("person", person))
            case pm.Undo(redo=redo):
                self._save(self._history.redo() if redo else self._history.undo())
        return True

    def reload(self) -> None:
        """Read the manifest again; earlier changes can no longer be undone.  Raises UserError."""
        self._history = lb.History(lb.labels_of(self.file.read()))

    def update(self) -> pm.LabelsUpdate:
        """All labels, as the page shows them."""
        entries, names = [], []
        for one in self._history.now:
            names += [one.row.posture] if one.row.posture != BACKGROUND else []
            take = self._take_of(one.row, -1)
            if take >= 0:
                begin_s, end_s = self._spans[take].start_s, self._spans[take].end_s
                start = begin_s if one.row.start is None else one.row.start
                end = end_s if one.row.end is None else one.row.end
                entries.append(pm.LabelEntry(one.id, take, start, end, one.row.posture, one.row.person))
        elsewhere = len(self._history.now) - len(entries)
        undo, redo = bool(self._history.before), bool(self._history.undone)
        return pm.LabelsUpdate(entries, elsewhere, list(dict.fromkeys(names)), list(self._people), undo, redo)

    def _set_person(self, take: int, person: str) -> bool:
        renamed = lb.rename_person(self._history.now, self.takes[take].source, person)
        changed = renamed != self._history.now
        if changed:
            self._change(renamed)
        self._people[take] = person
        return changed

    def _change(self, labels: lb.Labels) -> None:
        self._save(self._history.changed(labels))

    def _save(self, history: lb.History) -> None:
        """Write the labels, then keep them.  Raises UserError, and nothing has changed."""
        rows = self.file.write([one.row for one in history.now])
        lined = tuple(replace(one, row=row) for one, row in zip(history.now, rows, strict=True))
        self._history = replace(history, now=lined)

    def _take_of(self, row: ManifestRow, otherwise: int | None = None) -> int:
        """Number of a row's take.  Raises UserError for another source, unless `otherwise` is given."""
        for number, take in enumerate(self.takes):
            if lb.same(take.source, row.source):
                return number
        if otherwise is None:
            raise UserError(f"{row.source}: this take is not open")
        return otherwise

    def _person_of(self, take: MotionView, otherwise: str) -> str:
        own = [one.row.person for one in self._history.now if lb.same(one.row.source, take.source)]
        return own[-1] if own else otherwise


def _span_of(take: MotionView) -> lb.TakeSpan:
    features = take.features("directions")
    times_s = features.times_s
    return lb.TakeSpan(take.source, max(0.0, float(times_s[0])), float(times_s[-1]), lambda a, b: span(features, a, b))
