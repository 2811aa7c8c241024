"""The text of a rig file, checked: keys, types and ranges.  What it refers to is looked up in `common.runtime.rig`."""

import difflib
import re
import tomllib
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta

from common.runtime.animator_table import WITHIN, AnimatorTable, open_page_problem
from common.runtime.recognizer_table import RecognizerTable
from common.runtime.security import SecurityTable
from common.runtime.tracker_table import PARTICLES, TrackerTable

TRACKER_METHODS = tuple(PARTICLES)  # hybrid, and the two it is compared with: any number of views, at least two
METHODS = ("two-view", "joint", *TRACKER_METHODS)
MODES = ("peer", "client", "router")
NAME = re.compile(r"[A-Za-z0-9_.\-]{1,64}")  # what messages and keys allow
NAME_ALLOWED = "1 to 64 letters, digits, _ . and -"

Side = Annotated[int, Meta(ge=16, le=16384)]
Rate = Annotated[float, Meta(gt=0, le=1000)]


class RigError(ValueError):
    """A rig that cannot be used; the text names file, key, value and what is allowed."""


class ViewerTable(msgspec.Struct, frozen=True, kw_only=True):
    """One `[[viewer]]`.  initial: a separate video of the initial posture, shown before a file's own."""

    id: str
    camera: str
    source: int | str
    background: str = "first:60"
    size: tuple[Side, Side] | None = None
    fps: Rate | None = None
    initial: str | None = None
    preview: bool = False
    silhouette: bool = True


class ZenohTable(msgspec.Struct, frozen=True, kw_only=True):
    """How to reach the others, as Zenoh's own tools have it.  config: a Zenoh configuration file."""

    mode: str = "peer"
    connect: tuple[str, ...] = ()
    listen: tuple[str, ...] = ()
    config: str | None = None
    multicast_scouting: bool = True


class LogTable(msgspec.Struct, frozen=True, kw_only=True):
    """part_mb, part_minutes: when a take goes on in a new file, 10^6 bytes and minutes; 0 for never.

    foxglove: with channels that Foxglove and Lichtblick show, beside our own.
    """

    folder: str = "recordings"
    enabled: bool = True
    part_mb: Annotated[float, Meta(ge=0, le=1e9)] = 0.0
    part_minutes: Annotated[float, Meta(ge=0, le=1e6)] = 0.0
    foxglove: bool = True


class RigFile(msgspec.Struct, frozen=True, kw_only=True):
    """recognizer, security: None for a rig that does without."""

    name: str
    calibration: str
    viewer: tuple[ViewerTable, ...]
    up_axis: str = "y"
    method: str = "two-view"
    person_height: Annotated[float, Meta(ge=0.5, le=2.5)] | None = None  # metres; instead of the initial posture
    tracker: TrackerTable = TrackerTable()
    recognizer: RecognizerTable | None = None
    zenoh: ZenohTable = ZenohTable()
    log: LogTable = LogTable()
    animator: AnimatorTable = AnimatorTable()
    security: SecurityTable | None = None


TABLES: tuple[tuple[str, type[msgspec.Struct]], ...] = (
    ("tracker", TrackerTable), ("recognizer", RecognizerTable), ("zenoh", ZenohTable), ("log", LogTable),
    ("animator", AnimatorTable), ("security", SecurityTable),
)  # fmt: skip


def read_toml(path: Path) -> dict[str, object]:
    """The tables of a TOML file.  Raises RigError."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise RigError(f"{path}: not TOML: {error}") from error
    except OSError as error:
        raise RigError(f"{path}: cannot be read: {error.strerror}") from error


def rig_file(path: Path, tables: dict[str, object]) -> RigFile:
    """The checked content of the file at `path`.  Raises RigError."""
    _known(path, "", tables, RigFile)
    for key, kind in TABLES:
        _known(path, key, tables.get(key), kind)
    animator = tables.get("animator")
    for key, within in WITHIN.items():
        _known(path, f"animator.{key}", animator.get(key) if isinstance(animator, dict) else None, within)
    viewers = tables.get("viewer")
    if isinstance(viewers, dict):
        raise RigError(f"{path}: [viewer] is one table: allowed: [[viewer]], once per viewer")
    for number, viewer in enumerate(viewers if isinstance(viewers, list) else ()):
        _known(path, f"viewer[{number}]", viewer, ViewerTable)
    try:
        content = msgspec.convert(tables, RigFile)
    except msgspec.ValidationError as error:
        raise _in_words(path, tables, str(error)) from error
    _choice(path, "method", content.method, METHODS)
    _choice(path, "up_axis", content.up_axis, ("y", "z"))
    _choice(path, "zenoh.mode", content.zenoh.mode, MODES)
    problem = open_page_problem(content.animator.page)
    if problem:
        raise RigError(f"{path}: animator.page.host = {content.animator.page.host!r}: {problem}")
    _name(path, "name", content.name)
    seen: dict[str, int] = {}
    for number, table in enumerate(content.viewer):
        _name(path, f"viewer[{number}].id", table.id)
        if table.id in seen:
            other = f"viewer[{seen[table.id]}]"
            raise RigError(f"{path}: viewer[{number}].id = {table.id!r}: allowed: an id that {other} does not have")
        seen[table.id] = number
    return content


def did_you_mean(text: str, known: tuple[str, ...]) -> str:
    meant = difflib.get_close_matches(text, known, 1)
    return f"; did you mean {meant[0]!r}?" if meant else ""


def _choice(path: Path, key: str, value: str, allowed: tuple[str, ...]) -> None:
    if value not in allowed:
        words = ", ".join(repr(word) for word in allowed)
        raise RigError(f"{path}: {key} = {value!r}: allowed: {words}{did_you_mean(value, allowed)}")


def _name(path: Path, key: str, value: str) -> None:
    if not NAME.fullmatch(value):
        raise RigError(f"{path}: {key} = {value!r}: allowed: {NAME_ALLOWED}")


def _known(path: Path, where: str, table: object, kind: type[msgspec.Struct]) -> None:
    """RigError for a key that `kind` does not have."""
    if not isinstance(table, dict):
        return
    for key, value in table.items():
        if key not in kind.__struct_fields__:
            full = f"{where}.{key}" if where else key
            known = kind.__struct_fields__
            raise RigError(
                f"{path}: {full} = {value!r}: no such key; allowed: {', '.join(known)}{did_you_mean(key, known)}"
            )


def _in_words(path: Path, tables: dict[str, object], text: str) -> RigError:
    """msgspec's message with the value and our words: "Expected `float` <= 1000 - at `$.viewer[0].fps`"."""
    found = re.fullmatch(r"(.*?)(?: - at `\$\.?(.*)`)?", text, re.DOTALL)
    message, key = (found[1], found[2] or "") if found else (text, "")
    if missing := re.fullmatch(r"Object missing required field `(.*)`", message):
        return RigError(f"{path}: {key + '.' if key else ''}{missing[1]} is missing")
    numbers = re.findall(r"\w+", key)
    value: object = tables
    for step in numbers:
        if isinstance(value, dict):
            value = value.get(step)
        elif isinstance(value, list) and step.isdecimal() and int(step) < len(value):
            value = value[int(step)]
    expected = re.sub(r",? (?:but )?got .*", "", message.removeprefix("Expected ")).replace("`", "")
    return RigError(f"{path}: {key} = {value!r}: allowed: {expected.replace('array', 'list')}")
