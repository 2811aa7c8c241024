"""The `[recognizer]` table of a rig: posture model, source of the poses, commands.  [Two-view 5]

Also finds the model: a file relative to the rig, or one that is included in the package.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from zenocap.common.errors import UserError
from zenocap.common.rig.commands import CommandError, PostureCommand, posture_commands
from zenocap.common.rig.methods import method_of
from zenocap.data import POSTURES

Source = Literal["integrator", "tracker"]  # service that publishes the poses
SUFFIX = ".postures"
STRICTNESS = 0.18  # chosen on synthetic people tracked from video: see `zenocap.services.recognizer.segmentation`
Strictness = Annotated[float, Meta(ge=0, le=10)]


class RecognizerTable(msgspec.Struct, frozen=True, kw_only=True):
    """model: a file relative to the rig, or the name of one included in the package.

    source: "integrator" or "tracker"; default: the one that computes the poses in the rig's method.
    strictness: required gain in likelihood of a posture over movements made of parts of postures, as a fraction of the
    expected gain.  Higher values give fewer false and fewer correct detections.
    commands: actions by posture, see `zenocap.common.rig.commands`.
    allowed_programs: absolute paths of the programs that commands may start.
    """

    model: str = "fifteen"
    source: str | None = None
    strictness: Strictness = STRICTNESS
    commands: dict[str, object] = {}
    allowed_programs: tuple[str, ...] = ()


@dataclass(frozen=True)
class RecognizerSpec:
    """Recognizer settings with all defaults resolved.  model: file."""

    model: Path
    source: Source
    strictness: float = STRICTNESS
    commands: tuple[PostureCommand, ...] = ()


class RecognizerError(UserError):
    """The text contains the key, its value and the allowed values."""


def recognizer_spec(table: RecognizerTable, method: str, base: Path, *, files: bool = True) -> RecognizerSpec:
    """Resolve a table of a rig in the folder `base` for a method.  Raises RecognizerError.

    files: see `load_rig`.
    """
    source: Source = method_of(method).pose_service
    if table.source not in (None, source):
        raise RecognizerError(
            f"source = {table.source!r}: allowed: {source!r}, which publishes the poses of method {method!r}"
        )
    model = find_postures(table.model, base, must_exist=files)
    try:
        commands = posture_commands(table.commands, table.allowed_programs, must_exist=files)
    except CommandError as error:
        raise RecognizerError(str(error)) from error
    return RecognizerSpec(model, source, table.strictness, commands)


def find_postures(text: str, base: Path, *, must_exist: bool = True) -> Path:
    """Path of the included model of that name, or else of the file relative to `base`.

    must_exist: raise RecognizerError when there is neither.  ./NAME selects a file with the name of an included model.
    """
    shipped, own = POSTURES / f"{text}{SUFFIX}", base / text
    if "/" not in text and shipped.is_file():
        return shipped
    if must_exist and not own.is_file():
        names = ", ".join(sorted(path.stem for path in POSTURES.glob(f"*{SUFFIX}"))) or "none included in this version"
        raise RecognizerError(f"model = {text!r}: no file {own}; allowed: a file, or a name of: {names}")
    return own
