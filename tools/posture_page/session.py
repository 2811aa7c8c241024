"""What the page does: labels that are saved at once, training and trials in a thread, and the updates that follow."""

import queue
import shlex
import threading
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path

import msgspec

from zenocap.common.errors import UserError
from zenocap.common.runtime.service_info import versions
from zenocap.services.recognizer.model import PostureModel
from zenocap.services.recognizer.model_file import read_model
from zenocap.services.recognizer.training.example_files import span
from zenocap.services.recognizer.training.examples import BACKGROUND, TrainingSettings
from zenocap.services.recognizer.training.labelling import kind_of, suggestions_in
from zenocap.services.recognizer.training.manifest import Row
from zenocap.tools.posture_page import labels as lb
from zenocap.tools.posture_page import messages as pm
from zenocap.tools.posture_page import training, trial
from zenocap.tools.posture_page.manifest_file import ChangedOnDiskError, ManifestFile
from zenocap.tools.posture_page.motion_view import MotionView
from zenocap.tools.posture_page.parameters import LEAST_LABEL_S, POSITION_SCALE, QUATERNION_SCALE

Publish = Callable[[str, msgspec.Struct], None]
"""Key and update, for all pages."""


class Session:
    """State of the page.  `receive` and `turn` are called by one thread."""

    def __init__(
        self,
        takes: Sequence[MotionView],
        file: ManifestFile,
        person: str,
        read: training.ReadExamples,
        publish: Publish,
        *,
        suggesting: tuple[str, PostureModel] | None = None,
        settings: TrainingSettings | None = None,
    ) -> None:
        """person: of takes without a label.  suggesting: name and model of the first suggestions.  Raises UserError."""
        self._takes, self._file, self._read, self._publish = tuple(takes), file, read, publish
        self._settings = settings or TrainingSettings()
        self._suggesting = suggesting
        self._history = lb.History(lb.labels_of(file.read()))
        self._people = [self._person_of(take, person) for take in self._takes]
        self._spans = [_span_of(take) for take in self._takes]
        self._proposals = [take.proposals() for take in self._takes]
        self._model: PostureModel | None = None
        self._found: dict[int, list[trial.Found]] = {}
        self._trained_on: set[Path] = set()
        self._training = pm.TrainingUpdate("none")
        self._job: threading.Thread | None = None
        self._done: queue.Queue[Callable[[], None]] = queue.Queue()

    def open(self) -> None:
        """Publish everything, and take up a model that was trained before."""
        entries, warnings = [_entry(take) for take in self._takes], []
        if pairs := lb.overlaps(self._history.now):
            one, other = pairs[0]
            warnings.append(
                f"{self._file.path.name}: {len(pairs)} pairs of labels overlap, such as {one.row} and {other.row}: "
                "move or delete one of each"
            )
        if self._file.model.is_file():
            try:
                self._model = read_model(self._file.model)
                text = f"{self._file.model.name} was trained earlier"
                self._training = pm.TrainingUpdate("done", text, command=self._command)
            except (UserError, OSError) as error:
                warnings.append(f"{error}: Train replaces it")
        files = (str(self._file.path), str(self._file.model))
        self._publish("hello", pm.HelloUpdate(versions()["zenocap"], *files, entries, BACKGROUND, LEAST_LABEL_S, warnings))
        self._publish_labels()
        self._publish("training", self._training)
        self._suggest()

    @property
    def busy(self) -> bool:
        """Whether training or a trial runs."""
        return self._job is not None

    def turn(self) -> bool:
        """Handle what the thread has finished; returns whether there was anything."""
        busy = False
        while not self._done.empty():
            self._done.get()()
            busy = True
        return busy

    def receive(self, command: pm.Command) -> None:
        """Handle a command; one that is refused gives a notice."""
        try:
            self._handle(command)
        except ChangedOnDiskError as error:
            self._reload(str(error))
        except UserError as error:
            self._notice(str(error))
            self._publish_labels()  # a page that has moved a label shows it where it was

    def _handle(self, command: pm.Command) -> None:
        now = self._history.now
        match command:
            case pm.AddLabel(take=take, start_s=start_s, end_s=end_s, posture=posture):
                person = self._people[self._checked(take)]
                self._change(lb.add(now, self._spans[take], start_s, end_s, posture, person))
            case pm.ChangeLabel(id=id, start_s=start_s, end_s=end_s, posture=posture):
                span = self._spans[self._take_of(lb.find(now, id).row)]
                self._change(lb.change(now, span, id, start_s, end_s, posture))
            case pm.DeleteLabel(id=id):
                self._change(lb.remove(now, id))
            case pm.SetPerson(take=take, person=person):
                source = self._takes[self._checked(take)].source
                person = lb.checked_text("person", person)
                if (renamed := lb.rename_person(now, source, person)) != now:
                    self._change(renamed)
                self._people[take] = person
                self._publish_labels()
            case pm.Undo(redo=redo):
                self._save(self._history.redo() if redo else self._history.undo())
            case pm.Train():
                self._train()
            case pm.Try(take=take):
                self._try([self._checked(take)])
            case pm.AskPoses():
                pass  # answered by the page

    def _change(self, labels: lb.Labels) -> None:
        self._save(self._history.changed(labels))

    def _save(self, history: lb.History) -> None:
        """Write the labels, then show them.  Raises UserError, and nothing has changed."""
        rows = self._file.write([one.row for one in history.now])
        lined = tuple(replace(one, row=row) for one, row in zip(history.now, rows, strict=True))
        self._history = replace(history, now=lined)
        if self._training.state == "done" and not self._training.outdated:
            self._training = msgspec.structs.replace(self._training, outdated=True)
            self._publish("training", self._training)
        self._publish_labels()

    def _reload(self, reason: str) -> None:
        try:
            self._history = lb.History(lb.labels_of(self._file.read()))
        except UserError as error:
            reason = str(error)
        self._publish_labels()
        self._notice(reason)

    def _train(self) -> None:
        self._check_idle()
        rows = [one.row for one in self._history.now]
        training.check_rows(rows)
        self._publish_training(pm.TrainingUpdate("running", "starting"))

        def report(done: int, of: int, text: str) -> None:
            self._publish("training", pm.TrainingUpdate("running", text, done, of))

        def job() -> Callable[[], None]:
            try:
                result = training.train_rows(rows, self._read, self._file.model, self._settings, report)
                self._publish("training", pm.TrainingUpdate("running", "trying it on the takes"))
                found = {k: self._recognized(result.model, k) for k in range(len(self._takes))}
            except UserError as error:
                text = str(error)
                return lambda: self._publish_training(pm.TrainingUpdate("failed", text))
            return lambda: self._trained(rows, result, found)

        self._start(job)

    def _trained(self, rows: Sequence[Row], result: training.TrainingResult, found: dict[int, list[trial.Found]]) -> None:
        self._model, self._found = result.model, found
        self._trained_on = {row.source.resolve() for row in rows}
        postures = [pm.PostureRow(**asdict(one)) for one in result.postures]
        outdated = [one.row for one in self._history.now] != list(rows)
        text = f"{self._file.model.name} is written"
        self._publish_training(
            pm.TrainingUpdate("done", text, 0, 0, list(result.lines), postures, self._command, outdated)
        )  # fmt: skip
        self._suggesting = (self._file.model.name, result.model)
        self._suggest()
        for take in found:
            self._publish_trial(take)

    def _try(self, takes: Sequence[int]) -> None:
        self._check_idle()
        model = self._model
        if model is None:
            raise UserError("there is no model yet: allowed after Train")

        def job() -> Callable[[], None]:
            found = {take: self._recognized(model, take) for take in takes}
            return lambda: self._tried(found)

        self._start(job)

    def _tried(self, found: dict[int, list[trial.Found]]) -> None:
        self._found |= found
        for take in found:
            self._publish_trial(take)

    def _recognized(self, model: PostureModel, take: int) -> list[trial.Found]:
        return trial.recognized(model, self._takes[take].features(kind_of(model)))

    def _check_idle(self) -> None:
        if self.busy:
            raise UserError("training or a trial runs already: wait for its end")

    def _start(self, job: Callable[[], Callable[[], None]]) -> None:
        def run() -> None:
            finish = None
            try:
                finish = job()
            except Exception as error:
                text = f"{type(error).__name__}: {error}"
                finish = lambda: self._publish_training(pm.TrainingUpdate("failed", text))  # noqa: E731
                raise
            finally:
                self._done.put(lambda: self._finish(finish))

        self._job = threading.Thread(target=run, name="training", daemon=True)
        self._job.start()

    def _finish(self, finish: Callable[[], None] | None) -> None:
        self._job = None
        if finish is not None:
            finish()

    def _suggest(self) -> None:
        """Publish the proposals, with names by the model that suggests."""
        takes, name = [], ""
        for take, candidates in zip(self._takes, self._proposals, strict=True):
            guesses: list[tuple[str, bool]] = [("", False)] * len(candidates)
            if self._suggesting is not None:
                name, model = self._suggesting
                found = suggestions_in(model, take.features(kind_of(model)), candidates)
                guesses = [("", False) if guess is None else (guess.label, guess.known) for guess in found]
            takes.append(
                [
                    pm.Proposal(one.start_s, one.end_s, list(one.limbs), *guess)
                    for one, guess in zip(candidates, guesses, strict=True)
                ]
            )
        self._publish("proposals", pm.ProposalsUpdate(takes, name))

    def _publish_labels(self) -> None:
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
        update = pm.LabelsUpdate(entries, elsewhere, list(dict.fromkeys(names)), list(self._people), undo, redo)
        self._publish("labels", update)
        for take in self._found:
            self._publish_trial(take)

    def _publish_trial(self, take: int) -> None:
        assert self._model is not None
        labels = [(one.id, one.row) for one in self._history.now if self._take_of(one.row, -1) == take]
        compared = trial.compare(self._model, self._found[take], labels, self._spans[take].end_s)
        trained_on = self._takes[take].source.resolve() in self._trained_on or not self._trained_on
        found = [
            pm.FoundEntry(one.start_s, one.end_s, one.posture, round(one.confidence, 2), verdict)
            for one, verdict in compared.found
        ]
        update = pm.TrialUpdate(take, found, list(compared.missed), trial.words(compared, trained_on))
        self._publish(f"trial/{take}", update)

    def _publish_training(self, update: pm.TrainingUpdate) -> None:
        self._training = update
        self._publish("training", update)

    def _notice(self, text: str) -> None:
        self._publish("notice", pm.NoticeUpdate(text))

    @property
    def _command(self) -> str:
        """For live use."""
        return f"zenocap recognizer RIG --model {shlex.quote(str(self._file.model))}"

    def _checked(self, take: int) -> int:
        if take >= len(self._takes):
            raise UserError(f"take {take}: allowed: 0 to {len(self._takes) - 1}")
        return take

    def _take_of(self, row: Row, otherwise: int | None = None) -> int:
        """Number of a row's take.  Raises UserError for another source, unless `otherwise` is given."""
        for number, take in enumerate(self._takes):
            if lb.same(take.source, row.source):
                return number
        if otherwise is None:
            raise UserError(f"{row.source}: this take is not open")
        return otherwise

    def _person_of(self, take: MotionView, otherwise: str) -> str:
        own = [one.row.person for one in self._history.now if lb.same(one.row.source, take.source)]
        return own[-1] if own else otherwise


def _span_of(take: MotionView) -> lb.Span:
    features = take.features("directions")
    times_s = features.times_s
    return lb.Span(take.source, max(0.0, float(times_s[0])), float(times_s[-1]), lambda a, b: span(features, a, b))


def _entry(take: MotionView) -> pm.TakeEntry:
    times_s, (curve, top) = take.pose_times_s, take.curve()
    step_s = float(times_s[-1] - times_s[0]) / max(1, len(times_s) - 1)
    return pm.TakeEntry(
        name=take.source.name, start_s=float(take.track.times_s[0]), end_s=float(take.track.times_s[-1]), curve=curve,
        top=top, poses=len(times_s), chunk_poses=take.chunk_poses, pose_start_s=float(times_s[0]), pose_step_s=step_s,
        position_scale=POSITION_SCALE, quaternion_scale=QUATERNION_SCALE, body=take.body(),
    )  # fmt: skip
