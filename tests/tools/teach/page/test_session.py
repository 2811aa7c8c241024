"""Session of the page of postures: changes saved or refused, training, trial."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from tests.support.command import zenocap
from tests.support.posture_takes import NAMES, posture_spans, posture_take
from tests.tools.cli.posture.test_add import without_sources
from zenocap.common.errors import UserError
from zenocap.common.web.messages import NoticeUpdate
from zenocap.services.recognizer.model_file import read_model
from zenocap.services.recognizer.training.example_files import examples_of
from zenocap.services.recognizer.training.examples import Example, TrainingSettings
from zenocap.services.recognizer.training.manifest import ManifestRow, read_manifest, write_manifest
from zenocap.tools.teach.page import messages as pm
from zenocap.tools.teach.page.live_trial import LiveTrial
from zenocap.tools.teach.page.manifest_file import ManifestFile, manifest_at
from zenocap.tools.teach.page.motion_view import MotionView, open_motion
from zenocap.tools.teach.page.session import TeachingSession
from zenocap.tools.teach.page.training_settings import PageSettings, settings_for

PATIENCE_S = 120.0


def reader_of(manifest: Path) -> Callable[[Sequence[ManifestRow], Callable[[int, int, str], None]], list[Example]]:
    """Examples of takes, without rigs."""
    return lambda rows, report: examples_of(manifest, rows, "directions", report)


class Pages:
    """The latest update of every key, as the pages have it."""

    def __init__(
        self, take: MotionView, manifest: Path, settings: PageSettings | None = None, live: LiveTrial | None = None
    ) -> None:
        self.latest: dict[str, Any] = {}
        self.session = TeachingSession(
            [take], ManifestFile(manifest), "anna", reader_of(manifest), self.latest.__setitem__, settings=settings,
            live=live,
        )  # fmt: skip
        self.session.open()

    def send(self, *commands: pm.Command) -> str:
        """Handle commands; the text of the last notice, "" without one."""
        self.latest["notice"] = NoticeUpdate("")
        for command in commands:
            self.session.receive(command)
        return self.latest["notice"].text

    @property
    def labels(self) -> list[pm.LabelEntry]:
        return self.latest["labels"].labels

    def wait(self) -> pm.TrainingUpdate:
        """Until training or a trial has ended."""
        end_s = time.monotonic() + PATIENCE_S
        while self.session.busy:
            self.session.turn()
            assert time.monotonic() < end_s
            time.sleep(0.01)
        return self.latest["training"]


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> MotionView:
    return open_motion(posture_take(tmp_path_factory.mktemp("take") / "monday.mcap"))


@pytest.fixture
def manifest(tmp_path: Path) -> Path:
    return tmp_path / "examples.csv"


@pytest.fixture
def pages(take: MotionView, manifest: Path) -> Pages:
    return Pages(take, manifest)


def refuse(*_: object) -> None:
    raise OSError(30, "Read-only file system")


def adds(count: int = 9) -> list[pm.AddLabel]:
    """Commands that label the first postures of the take where they are."""
    return [pm.AddLabel(0, *span, name) for name, *span in posture_spans()[:count]]


@pytest.mark.nightly
def test_every_change_is_in_the_file_at_once_and_can_be_undone(pages, take, manifest) -> None:
    assert pages.send(*adds(3)) == ""
    rows = [(row.posture, row.person, row.repetition) for row in read_manifest(manifest)]
    assert rows == [(name, "anna", "1") for name in NAMES]
    first = pages.labels[0]
    assert pages.send(pm.ChangeLabel(first.id, first.start_s + 0.1, first.end_s, "wave")) == ""
    assert read_manifest(manifest)[0].posture == "wave"
    assert read_manifest(manifest)[0].start == pytest.approx(first.start_s + 0.1, abs=1e-3)
    pages.send(pm.DeleteLabel(first.id))
    assert len(read_manifest(manifest)) == 2
    pages.send(pm.Undo(), pm.Undo())
    assert [row.posture for row in read_manifest(manifest)] == list(NAMES)
    pages.send(pm.Undo(redo=True))
    assert read_manifest(manifest)[0].posture == "wave"
    pages.send(pm.SetPerson(0, "ben"))
    assert {row.person for row in read_manifest(manifest)} == {"ben"}
    pages.send(*[pm.DeleteLabel(one.id) for one in pages.labels])
    assert Pages(take, manifest).labels == []  # a manifest without rows is taken up


@pytest.mark.nightly
def test_an_existing_manifest_is_taken_up_with_the_rows_of_other_takes(take, manifest) -> None:
    other = manifest.with_name("other.mcap")
    other.touch()
    rows = [ManifestRow(0, other, 1.0, 2.0, "bow", "cat", "1"), ManifestRow(0, take.source, 4.0, 6.0, "wave", "ben", "1")]
    write_manifest(manifest, rows)
    pages = Pages(take, manifest)
    update = pages.latest["labels"]
    assert (len(update.labels), update.elsewhere, update.people, update.names) == (1, 1, ["ben"], ["bow", "wave"])
    pages.send(pm.DeleteLabel(update.labels[0].id))
    assert [(row.source.name, row.posture) for row in read_manifest(manifest)] == [("other.mcap", "bow")]


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("command", "words"),
    [
        (pm.AddLabel(0, 5.0, 7.0, ""), "posture = '': allowed: 1 to 64 printable characters"),
        (pm.AddLabel(0, 5.0, 7.0, "a\nb"), "allowed: 1 to 64 printable characters"),
        (pm.AddLabel(0, 5.0, 5.05, "wave"), "allowed for a label: 0.2 s or more"),
        (pm.AddLabel(0, 5.0, 6.0, "-"), "allowed for background: 2 s or more"),
        (pm.AddLabel(0, 5.0, 7000.0, "wave"), "allowed: within the take"),
        (pm.AddLabel(0, 0.0, 0.5, "wave"), "no angles from"),
        (pm.AddLabel(3, 5.0, 7.0, "wave"), "take 3: allowed: 0 to 0"),
        (pm.ChangeLabel(99, 5.0, 7.0, "wave"), "this label was deleted meanwhile"),
        (pm.DeleteLabel(99), "this label was deleted meanwhile"),
        (pm.SetPerson(0, " "), "person = '': allowed"),
        (pm.Undo(), "nothing to undo"),
        (pm.Undo(redo=True), "nothing to redo"),
        (pm.Train(), "no posture is labelled: allowed for training: two postures, or one and background"),
        (pm.Try(0), "there is no model yet: allowed after Train"),
    ],
)
def test_what_cannot_be_done_is_refused_in_one_line(command, words, pages, manifest) -> None:
    text = pages.send(command)
    assert words in text
    assert "\n" not in text
    assert not manifest.exists()


def test_overlapping_labels_are_refused_and_named_and_one_posture_is_not_trained(pages, manifest) -> None:
    pages.send(pm.AddLabel(0, 4.0, 6.0, "wave"))
    assert "only 'wave' is labelled" in pages.send(pm.Train())
    assert "overlaps 'wave', 4.00 s to 6.00 s" in pages.send(pm.AddLabel(0, 5.5, 7.0, "bow"))
    assert pages.send(pm.AddLabel(0, 6.0, 7.0, "bow")) == ""
    assert "overlaps 'bow'" in pages.send(pm.ChangeLabel(pages.labels[0].id, 4.0, 6.5, "wave"))
    assert [(row.start, row.end) for row in read_manifest(manifest)] == [(4.0, 6.0), (6.0, 7.0)]


def test_a_manifest_that_another_program_has_changed_is_read_again_and_not_overwritten(pages, take, manifest) -> None:
    pages.send(pm.AddLabel(0, 4.0, 6.0, "wave"))
    other = Pages(take, manifest)
    other.send(pm.AddLabel(0, 8.0, 9.0, "bow"))
    assert "another program has changed it" in pages.send(pm.AddLabel(0, 10.0, 11.0, "kick"))
    assert [one.posture for one in pages.labels] == ["wave", "bow"]
    assert pages.send(pm.AddLabel(0, 10.0, 11.0, "kick")) == ""
    assert [row.posture for row in read_manifest(manifest)] == ["wave", "bow", "kick"]


def test_a_manifest_that_cannot_be_written_leaves_the_labels_as_they_were(pages, monkeypatch) -> None:
    pages.send(pm.AddLabel(0, 4.0, 6.0, "wave"))
    monkeypatch.setattr("zenocap.tools.teach.page.manifest_file.write_manifest", refuse)
    assert "examples.csv: cannot be written: Read-only file system" in pages.send(pm.AddLabel(0, 8.0, 9.0, "bow"))
    assert [one.posture for one in pages.labels] == ["wave"]


def test_a_file_that_is_no_manifest_is_refused(take, manifest) -> None:
    manifest.write_text("to buy: milk\n", encoding="utf-8")
    with pytest.raises(UserError, match=r"examples\.csv: line 1"):
        Pages(take, manifest)
    assert manifest.read_text(encoding="utf-8") == "to buy: milk\n"
    with pytest.raises(UserError, match="allowed: a folder, or a manifest"):
        manifest_at(take.source)
    assert manifest_at(manifest.parent / "lessons") == manifest.parent / "lessons" / "examples.csv"


@pytest.mark.nightly
def test_training_writes_the_model_and_its_results_are_compared_with_the_labels(pages, take, manifest) -> None:
    pages.send(*adds())
    assert pages.send(pm.Train()) == ""
    assert "wait for its end" in pages.send(pm.Train())
    done = pages.wait()
    assert (done.state, done.outdated) == ("done", False)
    right = sum(row.right for row in done.postures)
    assert done.lines[0] == f"{right} of 9 examples are recognized by a model without that repetition."
    assert [(row.posture, row.examples, row.tested) for row in done.postures] == [(name, 3, 3) for name in NAMES]
    assert read_model(manifest.with_suffix(".postures")).labels == NAMES
    tried = pages.latest["trial/0"]
    assert sum(one.verdict == "right" for one in tried.found) >= 8
    last = pages.labels[-1]
    pages.send(pm.ChangeLabel(last.id, last.start_s, last.end_s, NAMES[0]))
    tried, changed = pages.latest["trial/0"], pages.latest["training"]
    assert changed.outdated
    assert tried.missed == [last.id]
    again = Pages(take, manifest)
    assert again.latest["training"].state == "done"
    again.send(pm.Try(0))
    again.wait()
    assert again.latest["trial/0"].found == tried.found


@pytest.mark.nightly
def test_a_model_that_cannot_be_written_fails_with_the_reason(pages, monkeypatch) -> None:
    monkeypatch.setattr("zenocap.tools.teach.page.training.write_model", refuse)
    pages.send(*adds(4), pm.Train())
    failed = pages.wait()
    assert failed.state == "failed"
    assert "examples.postures: cannot be written: Read-only file system" in failed.text


def test_a_rate_of_false_postures_without_background_is_refused_before_training(take, manifest) -> None:
    pages = Pages(take, manifest, PageSettings(TrainingSettings(false_per_hour=6.0)))
    text = pages.send(*adds(4), pm.Train())
    assert "false_per_hour = 6: no background: allowed for training: with some everyday" in text
    assert not pages.session.busy


def test_a_reason_why_settings_are_not_taken_over_is_a_warning_of_the_page(take, manifest) -> None:
    hello = Pages(take, manifest, PageSettings(warning="examples.examples: damaged")).latest["hello"]
    assert hello.warnings == ["examples.examples: damaged"]


@pytest.mark.nightly
def test_settings_of_training_are_kept_stated_and_used_again(take, manifest) -> None:
    model = manifest.with_suffix(".postures")
    pages = Pages(take, manifest, settings_for(model, 30.0, ("legs",)))
    arms = [command for command in adds() if command.posture != NAMES[2]]
    pages.send(*arms, pm.AddLabel(0, posture_spans()[-1][2] + 0.5, take.track.times_s[-1] - 0.1, "-"), pm.Train())
    done = pages.wait()
    assert done.state == "done", done.text
    assert "Settings of training: without legs, at most 30 false postures per hour." in done.lines
    assert [line.startswith("Warning: the background does not show 30 an hour: ") for line in done.lines].count(True) == 1
    trained, written = read_model(model), model.read_bytes()
    assert (trained.ignored, trained.training.settings["false_per_hour"]) == (("legs",), "30")
    again = Pages(take, manifest, settings_for(model, None, None))
    shown = again.latest["training"]
    kept = "(as in the last training)"
    assert shown.lines == [f"Settings of training: without legs {kept}, at most 30 false postures per hour {kept}."]
    again.send(pm.Train())
    assert shown.lines[0] in again.wait().lines
    assert model.read_bytes() == written


@pytest.mark.nightly
def test_a_model_of_the_page_is_extended_by_posture_add_as_if_trained_with_all_examples(pages, take, manifest) -> None:
    pages.send(*adds(6), pm.Train())
    pages.wait()
    model, further, both = manifest.with_suffix(".postures"), manifest.with_name("b.csv"), manifest.with_name("both.csv")
    rest = [ManifestRow(0, take.source, *span, name, "ben", "1") for name, *span in posture_spans()[6:9]]
    write_manifest(further, rest)
    write_manifest(both, [*read_manifest(manifest), *rest])
    assert zenocap("posture", "add", model, further)[0] == 0
    at_once = manifest.with_name("at-once.postures")
    assert zenocap("posture", "train", both, "-o", at_once)[0] == 0
    assert without_sources(read_model(model)) == without_sources(read_model(at_once))


@pytest.mark.nightly
def test_examples_that_cannot_be_kept_are_a_line_and_the_old_ones_are_deleted(pages, manifest, monkeypatch) -> None:
    store = manifest.with_suffix(".examples")
    store.write_bytes(b"of an earlier model")
    monkeypatch.setattr("zenocap.tools.teach.page.training.write_examples", refuse)
    pages.send(*adds(4), pm.Train())
    done = pages.wait()
    assert done.state == "done"
    assert f"posture add cannot extend this model: {store}: Read-only file system" in done.lines[-1]
    assert not store.exists()
