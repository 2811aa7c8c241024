"""Messages of the page of points in pictures; other side: `static/points_panel.js`."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

PointTask = Literal["scene", "lines"]

Name = Annotated[str, Meta(min_length=1, max_length=60, pattern=r"^[^\x00-\x1f\x7f\ud800-\udfff]+$")]
Metres = Annotated[float, Meta(ge=-1000.0, le=1000.0)]
Pixels = Annotated[float, Meta(ge=-1.0, le=65536.0)]


class StillUpdate(msgspec.Struct, frozen=True, tag="still", tag_field="type"):
    """The picture in which points are placed, at the size of the camera's images, px."""

    camera: str
    width: int
    height: int
    jpeg: bytes


class PointRow(msgspec.Struct, frozen=True):
    """A point of the room.  place: X, Y (height), Z in m; None where it was not given."""

    name: str
    place: tuple[float | None, float | None, float | None]


class FieldRow(msgspec.Struct, frozen=True):
    """A measured quantity besides points.  value: None where it was not given.  needed: whether nothing works without."""

    key: str
    name: str
    unit: str
    value: float | None
    needed: bool


class PlacedView(msgspec.Struct, frozen=True, kw_only=True):
    """One camera.  size: of its picture, px; None before the first.  picks: pixels by point.

    expected: where the solved camera sees each point, px, also those without a pick.  off_px: distance of each pick from
    there.  mm_per_px: error of a person in the middle by a pick that is one pixel off.  suspect: the point that contradicts
    the others most; "" for none.  lines: report, for people.  problem: why it is not solved; "" when it is.
    """

    name: str
    size: tuple[int, int] | None
    picks: dict[str, tuple[float, float]]
    expected: dict[str, tuple[float, float]] = {}
    off_px: dict[str, float] = {}
    mm_per_px: dict[str, float] = {}
    suspect: str = ""
    lines: list[str] = []
    problem: str = ""


class PointTaskUpdate(msgspec.Struct, frozen=True, tag="points", tag_field="type", kw_only=True):
    """Everything but the pictures.  editable: whether points can be added, renamed, moved and removed.

    centre_lines: whether the middle columns and rows are shown, on which the markers of [Two-view 4.1] have to lie.
    sentence: what to do next.  verdict: good, unchecked, poor, or "" before all cameras are solved.
    unsaved: whether there are changes since `written`, the names of the files.
    """

    task: PointTask
    editable: bool
    centre_lines: bool
    points: list[PointRow]
    fields: list[FieldRow]
    cameras: list[PlacedView]
    sentence: str
    verdict: str
    reasons: list[str]
    written: list[str]
    unsaved: bool
    busy: bool


class SetPoint(msgspec.Struct, frozen=True, tag="set_point", tag_field="type", forbid_unknown_fields=True):
    """Add a point of the room, or move it; m, None: not given."""

    point: Name
    place: tuple[Metres | None, Metres | None, Metres | None]


class RenamePoint(msgspec.Struct, frozen=True, tag="rename_point", tag_field="type", forbid_unknown_fields=True):
    """Rename a point and its picks."""

    point: Name
    to: Name


class RemovePoint(msgspec.Struct, frozen=True, tag="remove_point", tag_field="type", forbid_unknown_fields=True):
    """Remove a point and its picks."""

    point: Name


class Pick(msgspec.Struct, frozen=True, tag="pick", tag_field="type", forbid_unknown_fields=True):
    """Place a point in the picture of a camera: column and row, px, pixel centres at integers; None: remove it there."""

    camera: Name
    point: Name
    pixel: tuple[Pixels, Pixels] | None


class ClearPicks(msgspec.Struct, frozen=True, tag="clear_picks", tag_field="type", forbid_unknown_fields=True):
    """Remove all points from the picture of a camera."""

    camera: Name


class SetField(msgspec.Struct, frozen=True, tag="set_field", tag_field="type", forbid_unknown_fields=True):
    """Set a measured quantity; None: not given."""

    key: Annotated[str, Meta(max_length=40)]
    value: Metres | None


class NewPicture(msgspec.Struct, frozen=True, tag="new_picture", tag_field="type", forbid_unknown_fields=True):
    """Take the camera's newest image as its picture."""

    camera: Name


class Save(msgspec.Struct, frozen=True, tag="save", tag_field="type", forbid_unknown_fields=True):
    """Write points and calibration."""


PointCommand = SetPoint | RenamePoint | RemovePoint | Pick | ClearPicks | SetField | NewPicture | Save
