"""Messages between the live page of cameras and its server, as JSON; other side: `static/*.js`."""

from typing import Annotated, Literal, TypeAlias

import msgspec
from msgspec import Meta

from zenocap.common.web.messages import Decoder
from zenocap.tools.setup.page.advice import MeasureRow
from zenocap.tools.setup.page.point_messages import PointCommand

ModeName = Literal["cameras", "board", "points"]


class CameraEntry(msgspec.Struct, frozen=True):
    """A camera.  source: without password.  settles: whether its automatic exposure and focus can settle again.

    expected: size (px) that a calibration is for; None without one.
    """

    name: str
    source: str
    settles: bool
    expected: tuple[int, int] | None = None


class CameraHelloUpdate(msgspec.Struct, frozen=True, tag="hello", tag_field="type"):
    mode: ModeName
    version: str
    cameras: list[CameraEntry]


class PictureUpdate(msgspec.Struct, frozen=True, tag="picture", tag_field="type"):
    """A picture, reduced.  width, height: of the image of the camera, px.

    corners: x, y of the corners of a board, one after the other, pixels of the camera's image; None where no board is
    searched.
    """

    camera: str
    width: int
    height: int
    jpeg: bytes
    corners: list[float] | None = None


class StateUpdate(msgspec.Struct, frozen=True, tag="state", tag_field="type"):
    """Measures of a camera.  problem: why there is no image; "" while there are images."""

    camera: str
    problem: str
    rows: list[MeasureRow]


class BoardCamera(msgspec.Struct, frozen=True):
    """Progress of a camera, see `board_guide.CameraProgress`.

    cells: 1 for a covered cell of the image, row by row; asked: 1 for one in which the board is to be shown, or empty.
    """

    name: str
    moments: int
    coverage: float
    cells: list[int]
    asked: list[int]
    sides: int
    enough: bool


class BoardEdge(msgspec.Struct, frozen=True):
    """Two cameras, by number, that saw the board together at `moments` places.  enough: they are connected."""

    one: int
    other: int
    moments: int
    enough: bool


class BoardResult(msgspec.Struct, frozen=True):
    """A calibration.  verdict: good, poor or failed.  written: name of the file; "" for none."""

    verdict: str
    reasons: list[str]
    lines: list[str]
    written: str


class BoardUpdate(msgspec.Struct, frozen=True, tag="board", tag_field="type", kw_only=True):
    """Progress with the board.  sentence: what to show next.  missing: cameras that are not connected with the others.

    across: cells in a row.  floors: how often the board was on the floor.  busy: what runs now; "" for nothing.
    """

    sentence: str
    ready: bool
    missing: list[str]
    cameras: list[BoardCamera]
    edges: list[BoardEdge]
    across: int
    floors: int
    busy: str
    result: BoardResult | None


Name = Annotated[str, Meta(max_length=200)]


class Enlarge(msgspec.Struct, frozen=True, tag="enlarge", tag_field="type", forbid_unknown_fields=True):
    """The page shows this camera enlarged; "" for none."""

    camera: Name


class Anew(msgspec.Struct, frozen=True, tag="anew", tag_field="type", forbid_unknown_fields=True):
    """Measure anew, all cameras."""


class Settle(msgspec.Struct, frozen=True, tag="settle", tag_field="type", forbid_unknown_fields=True):
    """Open a camera again, so that its automatic exposure, white balance and focus settle anew."""

    camera: Name


class Calibrate(msgspec.Struct, frozen=True, tag="calibrate", tag_field="type", forbid_unknown_fields=True):
    """Calibrate from what was seen so far."""


class Floor(msgspec.Struct, frozen=True, tag="floor", tag_field="type", forbid_unknown_fields=True):
    """The board lies on the floor now."""


class Discard(msgspec.Struct, frozen=True, tag="discard", tag_field="type", forbid_unknown_fields=True):
    """Forget the views of the board so far: a camera was moved."""


class Finish(msgspec.Struct, frozen=True, tag="finish", tag_field="type", forbid_unknown_fields=True):
    """End the command."""


Command: TypeAlias = Enlarge | Anew | Settle | Calibrate | Floor | Discard | Finish | PointCommand
decode_command = Decoder[Command](Command)
