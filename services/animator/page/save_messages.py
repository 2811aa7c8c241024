"""Messages of a page that saves a take for other programs, and of the state of that work."""

from typing import Annotated, Literal, TypeAlias

import msgspec
from msgspec import Meta

Seconds = Annotated[float, Meta(ge=0, le=1e6)]
FILMS = ("mp4", "webm")
DRAWN = (*FILMS, "png")  # by `zenocap render`, the others by `zenocap export`
SaveState: TypeAlias = Literal["running", "done", "failed", "cancelled"]


class SaveFormat(msgspec.Struct, frozen=True):
    """A format of poses to choose.  title: for the user.  points: whether it has joint centres.  axes: allowed ones."""

    name: str
    title: str
    points: bool
    axes: list[str]


class SaveTake(msgspec.Struct, frozen=True, tag="save_take", tag_field="type", forbid_unknown_fields=True):
    """Command to save the take that is played.

    kind: one of DRAWN, or the name of a `SaveFormat`.
    start_s, end_s: position of the player, both inclusive; None for the ends of the take.  joints: convention of the
    points, axes: of exports.  smooth_hz: cut-off frequency, None for the poses as they are.  view, follow, size, theme,
    trails_s: of films and pictures.
    """

    kind: Annotated[str, Meta(max_length=200)]
    start_s: Seconds | None = None
    end_s: Seconds | None = None
    joints: Literal["zenocap", "isb", "coco", "halpe"] = "zenocap"
    axes: Literal["y-up", "z-up", "ros", "opensim", "unity", "unreal"] = "y-up"
    smooth_hz: Annotated[float, Meta(gt=0, le=1000)] | None = None
    view: Literal["quarter", "front", "back", "left", "right", "top"] = "quarter"
    follow: bool = False
    size: Literal["640x360", "1280x720", "1920x1080", "720x1280"] = "1280x720"
    theme: Literal["light", "dark"] = "light"
    trails_s: Annotated[float, Meta(ge=0, le=60)] = 0.0


class CancelSaving(msgspec.Struct, frozen=True, tag="cancel_saving", tag_field="type", forbid_unknown_fields=True):
    """Command to end the work on a file, which is then not saved."""


class SavingUpdate(msgspec.Struct, frozen=True, tag="saving", tag_field="type"):
    """State of the last file that was to be saved.

    name: of the file; before it is done, of the take and the kind.  done, total: pictures; total 0 where it is unknown.
    text: what was written, or one line why not.  notes: what the file lacks.  address: path from which the page gets the
    file, without the token; "" while there is none.  kept: whether it stays, beside the take, after the page has ended.
    """

    state: SaveState
    name: str
    done: int = 0
    total: int = 0
    text: str = ""
    notes: list[str] = []
    address: str = ""
    kept: bool = True
