"""Settings of the page's training: by options, else those that its model was trained with before."""

from dataclasses import dataclass, field, fields, replace
from pathlib import Path

from zenocap.common.errors import UserError
from zenocap.services.recognizer.ignored_parts import Part
from zenocap.services.recognizer.training.example_store import read_stored, store_path
from zenocap.services.recognizer.training.examples import TrainingSettings


@dataclass(frozen=True)
class PageSettings:
    """Settings of training.  kept: names of those that are from an earlier training and not the default ones.

    warning: why those of an earlier training cannot be taken over; "": none.
    """

    training: TrainingSettings = field(default_factory=TrainingSettings)
    kept: frozenset[str] = frozenset()
    warning: str = ""

    @property
    def line(self) -> str:
        """Both options of the page in words, and all other settings that are not the default ones."""
        training, rate = self.training, self.training.false_per_hour
        words = {
            "ignored": f"without {', '.join(training.ignored)}" if training.ignored else "whole body",
            "false_per_hour": "no limit of false postures" if rate is None else f"at most {rate:g} false postures per hour",
        }
        words |= {name: f"{name} {getattr(training, name)}" for name in _unusual(training) if name not in words}
        texts = [f"{text} (as in the last training)" if name in self.kept else text for name, text in words.items()]
        return f"Settings of training: {', '.join(texts)}."


def settings_for(model: Path, false_per_hour: float | None, ignored: tuple[Part, ...] | None) -> PageSettings:
    """Settings to train a model file with: those given, else those in the file of its examples, else the default ones.

    Raises UserError for values out of range, and for those that do not fit the others.
    """
    given = {name: value for name, value in (("false_per_hour", false_per_hour), ("ignored", ignored)) if value is not None}
    stored, store, warning = TrainingSettings(), store_path(model), ""
    if model.is_file():
        try:
            stored = read_stored(model)[1]
        except UserError as error:
            warning = f"{error}; Train does not take over the settings of {model.name}"
    try:
        settings = replace(stored, **given)  # type: ignore[arg-type]  # mypy has one type for all values of a dict
    except UserError as error:
        beside = "" if stored == TrainingSettings() else f"; other settings are those of {store}"
        raise UserError(f"{error}{beside}") from None
    return PageSettings(settings, frozenset(_unusual(settings)) - set(given), warning)


def _unusual(settings: TrainingSettings) -> list[str]:
    """Names of the settings that are not the default ones."""
    usual = TrainingSettings()
    return [one.name for one in fields(usual) if getattr(settings, one.name) != getattr(usual, one.name)]
