"""The `[recognizer]` table of a rig: posture model, source of the poses, commands.  [Two-view 5]

Also finds the model: a file relative to the rig, or one that is included in the package.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from zenocap.common.rig.commands import PostureCommand, posture_commands
from zenocap.common.rig.methods import method_of
from zenocap.common.rig.table_errors import TableError, shipped_or_own
from zenocap.data import POSTURES

Source = Literal["integrator", "tracker"]  # service that publishes the poses
SUFFIX = ".postures"
STRICTNESS = 0.18  # chosen on synthetic people tracked from video: see `zenocap.services.recognizer.parameters`
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


def recognizer_spec(table: RecognizerTable, method: str, base: Path, *, files: bool = True) -> RecognizerSpec:
    """Resolve a table of a rig in the folder `base` for a method.  Raises TableError.

    files: see `load_rig`.
    """
    source: Source = method_of(method).pose_service
    if table.source not in (None, source):
        raise TableError(f"source = {table.source!r}: allowed: {source!r}, which publishes the poses of method {method!r}")
    model = find_postures(table.model, base, must_exist=files)
    commands = posture_commands(table.commands, table.allowed_programs, must_exist=files)
    return RecognizerSpec(model, source, table.strictness, commands)


def find_postures(text: str, base: Path, *, must_exist: bool = True) -> Path:
    """Path of the included model of that name, or else of the file relative to `base`; see `shipped_or_own`."""
    return shipped_or_own("model", text, base, POSTURES, SUFFIX, must_exist=must_exist)
