"""`zenocap posture add`: the model of all examples, without the sources of the old ones."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.command import printed
from tests.support.posture_cases import LABELS
from zenocap.common.errors import UserError
from zenocap.services.recognizer.model import PostureModel
from zenocap.services.recognizer.model_file import packed, read_model
from zenocap.services.recognizer.training.example_store import joined, read_stored, store_path, write_examples
from zenocap.services.recognizer.training.examples import Example, TrainingSettings

OPTIONS = ("--symbols", 24, "--seed", 4)


def without_sources(model: PostureModel) -> bytes:
    """Bytes of a model without its list of sources, which names lines of the manifests."""
    return packed(Path(), replace(model, training=replace(model.training, sources=())))


def part(manifest: Path, name: str, labels: tuple[str, ...], people: str) -> Path:
    """A manifest of the rows of some postures and people."""
    head, *rows = manifest.read_text().splitlines()
    path = manifest.parent / name
    kept = [row for row in rows if row.split(",")[1] in labels and row.split(",")[2] in people]
    path.write_text("\n".join([head, *kept]) + "\n")
    return path


@pytest.mark.nightly
def test_a_model_with_added_examples_is_the_model_of_all_examples(manifest: Path, tmp_path: Path) -> None:
    first = part(manifest, "monday.csv", LABELS[:2], "12")
    further = part(manifest, "tuesday.csv", LABELS[2:], "123")
    both = tmp_path / "both.csv"
    both.write_text(first.read_text() + "\n".join(further.read_text().splitlines()[1:]) + "\n")
    model, at_once = tmp_path / "mine.postures", tmp_path / "at-once.postures"
    printed("posture", "train", first, "-o", model, *OPTIONS)
    printed("posture", "train", both, "-o", at_once, *OPTIONS)
    for row in first.read_text().splitlines()[1:]:
        (tmp_path / row.split(",")[0]).unlink()
    assert LABELS[2] in printed("posture", "add", model, further)
    assert without_sources(read_model(model)) == without_sources(read_model(at_once))
    assert read_stored(model)[1] == TrainingSettings(symbols=24, seed=4)


@pytest.mark.nightly
def test_examples_that_the_model_has_are_refused_and_another_output_leaves_the_model(
    manifest: Path, tmp_path: Path
) -> None:
    first, further = part(manifest, "a.csv", LABELS, "1"), part(manifest, "b.csv", LABELS, "2")
    model, new = tmp_path / "mine.postures", tmp_path / "new.postures"
    printed("posture", "train", first, "-o", model, *OPTIONS)
    before = model.read_bytes(), store_path(model).read_bytes()
    errors = printed("posture", "add", model, first, status=1)
    assert "the same movement as" in errors
    assert "allowed: further examples only" in errors
    printed("posture", "add", model, further, "-o", new)
    assert (model.read_bytes(), store_path(model).read_bytes()) == before
    assert read_model(new).training.people == ("1", "2")


def test_a_model_has_its_examples_in_a_file_of_another_name(manifest: Path, tmp_path: Path) -> None:
    errors = printed("posture", "add", tmp_path / "mine.postures", manifest, status=1)
    assert f"{tmp_path / 'mine.examples'}: no such file: allowed: a model with its examples, which" in errors
    errors = printed("posture", "train", manifest, "-o", tmp_path / "mine.examples", *OPTIONS, status=1)
    assert "suffix '.examples': allowed: any other, such as .postures" in errors
    assert not (tmp_path / "mine.examples").exists()


def example(label: str = "kick", repetition: str = "1", value: float = 0.5) -> Example:
    rows = np.full((30, 4), value)
    rows[3] = np.nan
    return Example(label, "ann", repetition, 25.0, rows, "m.csv: line 2")


def test_examples_come_back_exactly(tmp_path: Path) -> None:
    settings = TrainingSettings(ignored=("legs",), false_per_hour=6.0)
    model, examples = tmp_path / "a.postures", [example(value=1 / 3), example("-", "2")]
    model.write_bytes(b"a model")
    write_examples(model, examples, settings)
    back, read_settings = read_stored(model)
    assert read_settings == settings
    for one, other in zip(back, examples, strict=True):
        assert replace(one, features=other.features) == other
        assert one.features.tobytes() == other.features.tobytes()


def test_repetitions_that_are_taken_get_the_next_free_number() -> None:
    stored = [example(repetition="1", value=0.1), example(repetition="3", value=0.2)]
    further = [example(repetition="1", value=0.3), example(repetition="1", value=0.4), example("wave", "1", 0.5)]
    found = [(one.label, one.repetition) for one in joined(stored, further)]
    assert found == [("kick", "1"), ("kick", "3"), ("kick", "2"), ("kick", "4"), ("wave", "1")]


def test_damaged_files_are_refused_with_their_name(tmp_path: Path) -> None:
    model, path = tmp_path / "a.postures", tmp_path / "a.examples"
    model.write_bytes(b"a model")
    write_examples(model, [example()], TrainingSettings())
    data = path.read_bytes()
    path.write_bytes(data[:60] + b"x" + data[61:])
    with pytest.raises(UserError, match=f"{path}: damaged"):
        read_stored(model)
    path.write_bytes(data)
    model.write_bytes(b"trained by another command since")
    with pytest.raises(UserError, match=f"{path}: of another model than {model}"):
        read_stored(model)
