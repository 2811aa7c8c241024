"""Rig file: keys, types and ranges.  `zenocap.common.rig.rig` reads the files it refers to."""

import re
from pathlib import Path
from typing import Annotated, Literal, get_args

import msgspec
from msgspec import Meta

from zenocap.common.errors import UserError
from zenocap.common.rig.animator import AnimatorTable, OutputTable, PageTable, open_page_problem, smoothing_problem
from zenocap.common.rig.methods import AUTO, METHODS
from zenocap.common.rig.outputs import OUTPUTS, outputs_in
from zenocap.common.rig.recognizer import RecognizerTable
from zenocap.common.rig.table_errors import choice_problem, invalid_value, no_such_key, unknown_key
from zenocap.common.rig.tracker import TrackerTable

MODES = ("peer", "client", "router")
NAME = re.compile(r"[A-Za-z0-9_.\-]{1,64}")  # allowed in messages and keys
NAME_ALLOWED = "1 to 64 letters, digits, _ . and -"

Side = Annotated[int, Meta(ge=16, le=16384)]
Rate = Annotated[float, Meta(gt=0, le=1000)]
CameraValue = Annotated[int, Meta(ge=-(2**31), le=2**31 - 1)]
MAX_OFFSET_S = 3600.0
Offset = Annotated[float, Meta(ge=-MAX_OFFSET_S, le=MAX_OFFSET_S)]

Delays = Literal["off", "report", "follow"]
DELAYS: tuple[Delays, ...] = get_args(Delays)
MAX_DELAY_MS = 2000.0
Delay = Annotated[float, Meta(ge=0, le=MAX_DELAY_MS)]


class ViewerTable(msgspec.Struct, frozen=True, kw_only=True):
    """One `[[viewer]]`.  initial: a separate video of the T-pose, shown before a file's own.

    background: see `parse_background`; None: that of the source.
    offset_s: time at which a video file begins, seconds; only differences between the viewers count.
    delay_ms: age of the images of a camera or stream beyond their capture times; subtracted from these.
    hardware_decoding: whether a video file is decoded by hardware where that is possible.
    people: whether a small network corrects the silhouette, see `zenocap.services.viewer.people`.
    feedback: whether the tracker's pose helps its silhouettes, with an adaptive background.
    keep_background: whether an adaptive background is kept in a file and taken up again after a restart.
    format to focus: of a camera of this machine, see `CameraSettings`.
    """

    id: str
    camera: str
    source: int | str
    background: str | None = None
    size: tuple[Side, Side] | None = None
    fps: Rate | None = None
    initial: str | None = None
    offset_s: Offset = 0.0
    delay_ms: Delay = 0.0
    hardware_decoding: bool = False
    preview: bool = False
    people: bool = False
    silhouette: bool = True
    feedback: bool = False
    keep_background: bool = False
    format: str | None = None
    exposure: CameraValue | str | None = None
    gain: CameraValue | str | None = None
    white_balance: CameraValue | str | None = None
    focus: CameraValue | str | None = None


class ZenohTable(msgspec.Struct, frozen=True, kw_only=True):
    """Network settings, as in Zenoh's own tools.  config: a Zenoh configuration file."""

    mode: str = "peer"
    connect: tuple[str, ...] = ()
    listen: tuple[str, ...] = ()
    config: str | None = None
    multicast_scouting: bool = True


class LogTable(msgspec.Struct, frozen=True, kw_only=True):
    """part_mb, part_minutes: largest size (10^6 bytes) and duration (minutes) of a part of a take; 0 for unlimited.

    foxglove: whether to add channels that Foxglove and Lichtblick display.
    """

    folder: str = "recordings"
    enabled: bool = True
    part_mb: Annotated[float, Meta(ge=0, le=1e9)] = 0.0
    part_minutes: Annotated[float, Meta(ge=0, le=1e6)] = 0.0
    foxglove: bool = True


class SecurityTable(msgspec.Struct, frozen=True, kw_only=True):
    """certificates: folder of the certificates made by `zenocap certs`, relative to the rig file."""

    certificates: Annotated[str, Meta(min_length=1)] = "certs"


class RigFile(msgspec.Struct, frozen=True, kw_only=True):
    """recognizer, security: None for a rig without them.  film: whether `zenocap film` may record the cameras while the rig
    runs.  variant, additions, without: of two-view, see `two_view`.
    delays: of the cameras: estimated while a rig with a tracker runs (report), and corrected (follow), or not (off)."""

    name: str
    calibration: str
    viewer: tuple[ViewerTable, ...]
    up_axis: str = "y"
    method: str = AUTO
    variant: str = "improved"
    additions: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    person_height: Annotated[float, Meta(ge=0.5, le=2.5)] | None = None  # metres; of the body until the T-pose
    tracker: TrackerTable = TrackerTable()
    recognizer: RecognizerTable | None = None
    zenoh: ZenohTable = ZenohTable()
    log: LogTable = LogTable()
    animator: AnimatorTable = AnimatorTable()
    security: SecurityTable | None = None
    film: bool = False
    delays: str = "report"


TABLES: tuple[tuple[str, type[msgspec.Struct]], ...] = (
    ("tracker", TrackerTable), ("recognizer", RecognizerTable), ("zenoh", ZenohTable), ("log", LogTable),
    ("security", SecurityTable),
)  # fmt: skip


def rig_file(path: Path, tables: dict[str, object]) -> RigFile:
    """The checked content of the file at `path`.  Raises UserError."""
    _known(path, "", tables, RigFile)
    for key, kind in TABLES:
        _known(path, key, tables.get(key), kind)
    tables, outputs = _without_outputs(path, tables)
    viewers = tables.get("viewer")
    if isinstance(viewers, dict):
        raise UserError(f"{path}: [viewer] is one table: allowed: [[viewer]], once per viewer")
    for number, viewer in enumerate(viewers if isinstance(viewers, list) else ()):
        _known(path, f"viewer[{number}]", viewer, ViewerTable)
    try:
        content = msgspec.convert(tables, RigFile)
    except msgspec.ValidationError as error:
        raise UserError(f"{path}: {invalid_value(tables, str(error))}") from error
    _choice(path, "delays", content.delays, DELAYS)
    _choice(path, "method", content.method, (AUTO, *METHODS.names()))
    _choice(path, "up_axis", content.up_axis, ("y", "z"))
    _choice(path, "zenoh.mode", content.zenoh.mode, MODES)
    problem = open_page_problem(content.animator.page)
    if problem:
        raise UserError(f"{path}: animator.page.host = {content.animator.page.host!r}: {problem}")
    problem = smoothing_problem(content.animator.smooth, content.animator.smooth_hz, content.animator.smooth_beta)
    if problem:
        raise UserError(f"{path}: animator.{problem}")
    content = msgspec.structs.replace(content, animator=msgspec.structs.replace(content.animator, outputs=outputs))
    _name(path, "name", content.name)
    seen: dict[str, int] = {}
    for number, table in enumerate(content.viewer):
        _name(path, f"viewer[{number}].id", table.id)
        if table.id in seen:
            other = f"viewer[{seen[table.id]}]"
            raise UserError(f"{path}: viewer[{number}].id = {table.id!r}: allowed: an id that {other} does not have")
        seen[table.id] = number
    return content


def _without_outputs(path: Path, tables: dict[str, object]) -> tuple[dict[str, object], dict[str, OutputTable]]:
    """The tables without the outputs of the animator, whose kinds are in a table of their own; and these."""
    animator = tables.get("animator")
    if not isinstance(animator, dict):
        return tables, {}
    own = tuple(name for name in AnimatorTable.__struct_fields__ if name != "outputs")
    for key, value in animator.items():
        if key not in (*own, *OUTPUTS.names()):
            raise UserError(f"{path}: {no_such_key('animator', key, value, (*own, *OUTPUTS.names()))}")
    _known(path, "animator.page", animator.get("page"), PageTable)
    rest = {key: value for key, value in animator.items() if key in own}
    return {**tables, "animator": rest}, outputs_in(path, animator)


def _choice(path: Path, key: str, value: str, allowed: tuple[str, ...]) -> None:
    if value not in allowed:
        raise UserError(f"{path}: {choice_problem(key, value, allowed)}")


def _name(path: Path, key: str, value: str) -> None:
    if not NAME.fullmatch(value):
        raise UserError(f"{path}: {key} = {value!r}: allowed: {NAME_ALLOWED}")


def _known(path: Path, where: str, table: object, kind: type[msgspec.Struct]) -> None:
    """Raise UserError for a key that `kind` does not have."""
    problem = unknown_key(where, table, kind)
    if problem is not None:
        raise UserError(f"{path}: {problem}")
