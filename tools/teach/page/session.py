"""Session of the page: commands that change labels, training and trials in a thread, updates."""

import shlex
from collections.abc import Callable, Sequence
from pathlib import Path

import msgspec

from zenocap.common.errors import UserError
from zenocap.common.runtime.service_info import versions
from zenocap.common.web.messages import NoticeUpdate
from zenocap.common.web.page import NOTICE
from zenocap.services.recognizer.model import PostureModel
from zenocap.services.recognizer.model_file import read_model
from zenocap.services.recognizer.stream import stream_setup
from zenocap.services.recognizer.training.examples import BACKGROUND
from zenocap.services.recognizer.training.labelling import suggestions_in
from zenocap.services.recognizer.training.manifest import ManifestRow
from zenocap.services.recognizer.training.stream_evaluation import PostureAnswer, answers_of
from zenocap.tools.teach.page import labels as lb
from zenocap.tools.teach.page import messages as pm
from zenocap.tools.teach.page import training, trial
from zenocap.tools.teach.page.background_job import BackgroundJob
from zenocap.tools.teach.page.labelled_takes import LabelCommand, LabelledTakes
from zenocap.tools.teach.page.live_trial import LiveTrial
from zenocap.tools.teach.page.manifest_file import ChangedOnDiskError, ManifestFile
from zenocap.tools.teach.page.motion_view import MotionView
from zenocap.tools.teach.page.parameters import LEAST_LABEL_S, POSITION_SCALE, QUATERNION_SCALE
from zenocap.tools.teach.page.training_settings import PageSettings

Publish = Callable[[str, msgspec.Struct], None]
"""Key and update, for all pages."""


class TeachingSession:
    """State of the page.  `receive` and `turn` are called by one thread."""

    def __init__(
        self, takes: Sequence[MotionView], file: ManifestFile, person: str, read: training.ReadExamples, publish: Publish,
        *, suggesting: tuple[str, PostureModel] | None = None, settings: PageSettings | None = None,
        live: LiveTrial | None = None,
    ) -> None:  # fmt: skip
        """person: of takes without a label.  suggesting: name and model of the first suggestions.  live: of a rig.

        Raises UserError.
        """
        self._live = live
        self._takes, self._model_path, self._read, self._publish = tuple(takes), file.model, read, publish
        self.settings = settings or PageSettings()
        self._suggesting = suggesting
        self._labels = LabelledTakes(takes, file, person)
        self._proposals = [take.proposals() for take in self._takes]
        self._model: PostureModel | None = None
        self._found: dict[int, list[PostureAnswer]] = {}
        self._trained_on: set[Path] = set()
        self._training = pm.TrainingUpdate("none")
        self._job = BackgroundJob(lambda text: self._publish_training(pm.TrainingUpdate("failed", text)))

    def open(self) -> None:
        """Publish everything, and take up a model that was trained before."""
        entries, warnings = [_entry(take) for take in self._takes], []
        if pairs := lb.overlaps(self._labels.labels):
            one, other = pairs[0]
            warnings.append(
                f"{self._labels.file.path.name}: {len(pairs)} pairs of labels overlap, such as {one.row} and {other.row}: "
                "move or delete one of each"
            )
        if self.settings.warning:
            warnings.append(self.settings.warning)
        if self._model_path.is_file():
            try:
                self._model = read_model(self._model_path)
                text = f"{self._model_path.name} was trained earlier"
                self._training = pm.TrainingUpdate("done", text, lines=[self.settings.line], command=self._command)
            except (UserError, OSError) as error:
                warnings.append(f"{error}: Train replaces it")
        files = (str(self._labels.file.path), str(self._model_path))
        rig = "" if self._live is None else self._live.name
        self._publish(
            "hello", pm.TeachHelloUpdate(versions()["zenocap"], *files, entries, BACKGROUND, LEAST_LABEL_S, warnings, rig)
        )
        self._publish_labels()
        self._publish("training", self._training)
        self._suggest()

    def close(self) -> None:
        """End the live trial."""
        if self._live is not None:
            self._live.stop()

    @property
    def busy(self) -> bool:
        """Whether training or a trial runs."""
        return self._job.busy

    def turn(self) -> bool:
        """Handle what the thread has finished; returns whether there was anything."""
        return self._job.turn()

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
        match command:
            case pm.Train():
                self._train()
            case pm.Try(take=take):
                self._try(self._labels.checked(take))
            case pm.TryLive(on=on):
                self._try_live(on)
            case pm.AskPoses():
                pass  # answered by the page
            case _:
                self._change_labels(command)

    def _change_labels(self, command: LabelCommand) -> None:
        """Save a change, then show it.  Raises UserError, and nothing has changed."""
        if self._labels.handle(command) and self._training.state == "done" and not self._training.outdated:
            self._publish_training(msgspec.structs.replace(self._training, outdated=True))
        self._publish_labels()

    def _reload(self, reason: str) -> None:
        try:
            self._labels.reload()
        except UserError as error:
            reason = str(error)
        self._publish_labels()
        self._notice(reason)

    def _train(self) -> None:
        self._check_idle()
        rows = self._labels.rows
        training.check_rows(rows, self.settings.training)
        self._publish_training(pm.TrainingUpdate("running", "starting"))

        def report(done: int, of: int, text: str) -> None:
            self._publish("training", pm.TrainingUpdate("running", text, done, of))

        def job() -> Callable[[], None]:
            try:
                result = training.train_rows(rows, self._read, self._model_path, self.settings, report)
                self._publish("training", pm.TrainingUpdate("running", "trying it on the takes"))
                found = {k: self._recognized(result.model, k) for k in range(len(self._takes))}
            except UserError as error:
                text = str(error)
                return lambda: self._publish_training(pm.TrainingUpdate("failed", text))
            return lambda: self._trained(rows, result, found)

        self._job.start(job)

    def _trained(
        self, rows: Sequence[ManifestRow], result: training.TrainingResult, found: dict[int, list[PostureAnswer]]
    ) -> None:
        self._model, self._found = result.model, found
        self._trained_on = {row.source.resolve() for row in rows}
        outdated = self._labels.rows != list(rows)
        text, lines, postures = f"{self._model_path.name} is written", list(result.lines), list(result.postures)
        self._publish_training(pm.TrainingUpdate("done", text, 0, 0, lines, postures, self._command, outdated))
        self._suggesting = (self._model_path.name, result.model)
        self._suggest()
        if self._live is not None and self._live.running:
            self._live.start(result.model)
        for take in found:
            self._publish_trial(take)

    def _try(self, take: int) -> None:
        self._check_idle()
        model = self._model
        if model is None:
            raise UserError("there is no model yet: allowed after Train")

        def job() -> Callable[[], None]:
            found = self._recognized(model, take)
            return lambda: self._tried(take, found)

        self._job.start(job)

    def _try_live(self, on: bool) -> None:
        if self._live is None:
            raise UserError("there is no rig: allowed after `zenocap posture label TAKE --rig RIG`")
        if not on:
            self._live.stop()
            return
        if self._model is None:
            raise UserError("there is no model yet: allowed after Train")
        self._live.start(self._model)

    def _tried(self, take: int, found: list[PostureAnswer]) -> None:
        self._found[take] = found
        self._publish_trial(take)

    def _recognized(self, model: PostureModel, take: int) -> list[PostureAnswer]:
        return answers_of(stream_setup(model), self._takes[take].features(model.features))

    def _check_idle(self) -> None:
        if self.busy:
            raise UserError("training or a trial runs already: wait for its end")

    def _suggest(self) -> None:
        """Publish the proposals, with names by the model that suggests."""
        takes, name = [], ""
        for take, candidates in zip(self._takes, self._proposals, strict=True):
            guesses: list[tuple[str, bool]] = [("", False)] * len(candidates)
            if self._suggesting is not None:
                name, model = self._suggesting
                found = suggestions_in(model, take.features(model.features), candidates)
                guesses = [("", False) if guess is None else (guess.label, guess.known) for guess in found]
            named = zip(candidates, guesses, strict=True)
            takes.append([pm.Proposal(one.start_s, one.end_s, list(one.limbs), *guess) for one, guess in named])
        self._publish("proposals", pm.ProposalsUpdate(takes, name))

    def _publish_labels(self) -> None:
        self._publish("labels", self._labels.update())
        for take in self._found:
            self._publish_trial(take)

    def _publish_trial(self, take: int) -> None:
        assert self._model is not None
        compared = trial.compare(self._model, self._found[take], self._labels.labels_in(take), self._labels.end_s(take))
        trained_on = self._takes[take].source.resolve() in self._trained_on or not self._trained_on
        found = [
            pm.FoundEntry(one.start_s, one.end_s, one.label, round(one.confidence, 2), verdict)
            for one, verdict in compared.found
        ]
        update = pm.TrialUpdate(take, found, list(compared.missed), trial.words(compared, trained_on))
        self._publish(f"trial/{take}", update)

    def _publish_training(self, update: pm.TrainingUpdate) -> None:
        self._training = update
        self._publish("training", update)

    def _notice(self, text: str) -> None:
        self._publish(NOTICE, NoticeUpdate(text))

    @property
    def _command(self) -> str:
        """For live use."""
        return f"zenocap recognizer RIG --model {shlex.quote(str(self._model_path))}"


def _entry(take: MotionView) -> pm.TakeEntry:
    times_s, (curve, top) = take.pose_times_s, take.curve()
    step_s = float(times_s[-1] - times_s[0]) / max(1, len(times_s) - 1)
    return pm.TakeEntry(
        name=take.source.name, start_s=float(take.track.times_s[0]), end_s=float(take.track.times_s[-1]), curve=curve,
        top=top, poses=len(times_s), chunk_poses=take.chunk_poses, pose_start_s=float(times_s[0]), pose_step_s=step_s,
        position_scale=POSITION_SCALE, quaternion_scale=QUATERNION_SCALE, body=take.body(),
    )  # fmt: skip
