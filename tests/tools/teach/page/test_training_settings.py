"""Settings of the page's training: options, else those of the last training of its model."""

from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.posture_cases import examples, quick_model
from zenocap.common.errors import UserError
from zenocap.services.recognizer.model_file import write_model
from zenocap.services.recognizer.training.example_store import store_path, write_examples
from zenocap.services.recognizer.training.examples import TrainingSettings
from zenocap.tools.teach.page.training_settings import PageSettings, settings_for

STORED = TrainingSettings(ignored=("legs",), false_per_hour=6.0, seed=3)


@pytest.fixture
def model(tmp_path: Path) -> Path:
    return tmp_path / "examples.postures"


def trained(model: Path, settings: TrainingSettings = STORED) -> Path:
    write_model(model, quick_model())
    write_examples(model, examples(), settings)
    return model


def test_without_a_model_the_options_and_the_default_settings_hold(model: Path) -> None:
    assert settings_for(model, None, None) == PageSettings()
    assert PageSettings().line == "Settings of training: whole body, no limit of false postures."
    found = settings_for(model, 6.0, ("legs", "head"))
    assert found.training == TrainingSettings(false_per_hour=6.0, ignored=("legs", "head"))
    assert found.line == "Settings of training: without legs, head, at most 6 false postures per hour."


def test_settings_of_the_last_training_hold_where_no_option_is_given(model: Path) -> None:
    trained(model)
    found = settings_for(model, None, None)
    assert (found.training, found.warning) == (STORED, "")
    assert found.line == (
        "Settings of training: without legs (as in the last training), at most 6 false postures per hour (as in the last "
        "training), seed 3 (as in the last training)."
    )
    found = settings_for(model, 12.0, None)
    assert found.training == replace(STORED, false_per_hour=12.0)
    assert "without legs (as in the last training), at most 12 false postures per hour, seed 3 (as" in found.line
    found = settings_for(model, None, ())
    assert found.training == replace(STORED, ignored=())
    assert "whole body, at most 6 false postures per hour (as in" in found.line


def test_settings_without_their_model_are_not_taken_over(model: Path) -> None:
    trained(model).unlink()
    assert settings_for(model, None, None) == PageSettings()


def test_settings_that_cannot_be_read_are_a_warning(model: Path) -> None:
    store = store_path(trained(model))
    model.write_bytes(b"trained by another command since")
    found = settings_for(model, 6.0, None)
    assert found.training == TrainingSettings(false_per_hour=6.0)
    assert found.warning.startswith(f"{store}: of another model than {model}: ")
    assert found.warning.endswith("; Train does not take over the settings of examples.postures")
    store.unlink()
    found = settings_for(model, None, None)
    assert (found.training, found.kept) == (TrainingSettings(), frozenset())
    assert found.warning.startswith(f"{store}: cannot be read: No such file or directory; ")


def test_an_option_that_does_not_fit_the_settings_of_the_last_training_names_their_file(model: Path) -> None:
    trained(model, TrainingSettings(classifier="paper"))
    with pytest.raises(
        UserError, match=f"classifier forest with thresholds; other settings are those of {store_path(model)}"
    ):
        settings_for(model, 6.0, None)
    model.unlink()
    with pytest.raises(UserError, match=r"^false_per_hour = 0.0: allowed: 0.001 to 3600$"):
        settings_for(model, 0.0, None)
