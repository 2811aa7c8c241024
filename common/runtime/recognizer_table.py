"""The `[recognizer]` table of a rig: which postures are told apart, and whose poses are listened to.  [Two-view 5]

What it refers to is looked up here too: a model is a file beside the rig, or one of those that come with the project.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

Source = Literal["integrator", "tracker"]  # whose poses
POSTURES = Path(__file__).resolve().parents[2] / "deploy" / "postures"
SUFFIX = ".postures"
STRICTNESS = 0.18  # chosen on synthetic people tracked from video: see `services.recognizer.spotting`
Strictness = Annotated[float, Meta(ge=0, le=10)]


class RecognizerTable(msgspec.Struct, frozen=True, kw_only=True):
    """model: a file relative to the rig, or the name of one that comes with the project.

    source: "integrator" or "tracker"; default: the one that finds the poses by the rig's method.
    strictness: how much likelier than movements made of parts of postures one must be, as a share of what is usual; more:
    fewer false postures, and fewer right ones.
    """

    model: str = "fifteen"
    source: str | None = None
    strictness: Strictness = STRICTNESS


@dataclass(frozen=True)
class RecognizerSpec:
    """A recogniser's table with everything decided.  model: file."""

    model: Path
    source: Source
    strictness: float = STRICTNESS


class RecognizerError(ValueError):
    """The text is the key with its value, and what is allowed."""


def recognizer_spec(table: RecognizerTable, method: str, tracks: bool, base: Path, *, files: bool = True) -> RecognizerSpec:
    """What a table in the folder `base` means for a method.  Raises RecognizerError.

    tracks: the method has a tracker, which then is the one that finds the poses.  files: see `load_rig`.
    """
    source: Source = "tracker" if tracks else "integrator"
    if table.source not in (None, source):
        raise RecognizerError(f"source = {table.source!r}: allowed: {source!r}, which finds the poses by method {method!r}")
    return RecognizerSpec(find_postures(table.model, base, must_be=files), source, table.strictness)


def find_postures(text: str, base: Path, *, must_be: bool = True) -> Path:
    """The model that comes with the project under that name, or else the file in the folder `base`.

    must_be: raise RecognizerError when there is neither.  A file that has the name of such a model is meant by ./NAME.
    """
    shipped, own = POSTURES / f"{text}{SUFFIX}", base / text
    if "/" not in text and shipped.is_file():
        return shipped
    if must_be and not own.is_file():
        names = ", ".join(sorted(path.stem for path in POSTURES.glob(f"*{SUFFIX}"))) or "none come with this version"
        raise RecognizerError(f"model = {text!r}: no file {own}; allowed: a file, or a name of: {names}")
    return own
