"""What goes to a browser and what may come from it, as JSON.  The page's own `static/` reads and writes the same.

Lengths in metres, angles in degrees (people read them), times in milliseconds since the Unix epoch.  Coordinates are those
of the world; quaternions are x, y, z, w.  Lists of numbers are flat, part after part.
"""

from typing import Annotated, Literal, TypeAlias

import msgspec
from msgspec import Meta

Feed = Literal["live", "take"]
Numbers: TypeAlias = list[float]


class Hello(msgspec.Struct, frozen=True, tag="hello", tag_field="is"):
    """Of the rig, and of this animator."""

    rig: str
    method: str
    version: str
    viewers: list[str]
    can_record: bool


class BodyShape(msgspec.Struct, frozen=True, tag="body", tag_field="is"):
    """near, far: long and short radius of each part's ends.  markers: names of the joint centres of a `PoseShape`."""

    source: str
    parts: list[str]
    lengths: Numbers
    near: Numbers
    far: Numbers
    markers: list[str]
    angles: list[str]
    height: float


class PoseShape(msgspec.Struct, frozen=True, tag="pose", tag_field="is"):
    """positions: of each part's near end.  captured_ms: of the instant; received_ms: when the animator had it."""

    source: str
    frame: int
    captured_ms: float
    received_ms: float
    positions: Numbers
    quaternions: Numbers
    centres: Numbers
    angles: Numbers
    lost: list[str]


class PointsShape(msgspec.Struct, frozen=True, tag="points", tag_field="is"):
    """The scene points as the bus has them (`common.messages.ScenePoints`), base64."""

    data: bytes


class CameraShape(msgspec.Struct, frozen=True, tag="camera", tag_field="is"):
    """centre, and corners of its picture one metre away (left top, right top, right bottom, left bottom)."""

    viewer: str
    name: str
    size: tuple[int, int]
    centre: Numbers
    corners: Numbers


class Outline(msgspec.Struct, frozen=True):
    """One part as a camera sees it.  corners: x, y of a convex outline, pixels of the silhouette."""

    part: str
    corners: Numbers


class ViewShape(msgspec.Struct, frozen=True, tag="view", tag_field="is"):
    """One viewer's silhouette as the bus has it (`common.messages.Silhouette`), and the model as it should be in it.

    data: base64.  score: of the model in this view, Eq. 1, or None.
    """

    viewer: str
    size: tuple[int, int]
    region: tuple[int, int, int, int]
    data: bytes
    outlines: dict[str, list[Outline]]
    role: str
    score: float | None


class PreviewShape(msgspec.Struct, frozen=True, tag="preview", tag_field="is"):
    viewer: str
    jpeg: bytes


class ServiceRow(msgspec.Struct, frozen=True):
    """latency_ms: how old its result is when said, or None.  dropped: frames and messages it lost."""

    name: str
    id: str
    condition: str
    silent_s: float
    state: str
    rate: float
    latency_ms: float | None
    dropped: int
    offset_ms: float | None
    memory_mb: float


class Rows(msgspec.Struct, frozen=True, tag="rows", tag_field="is"):
    """recording: whether a take is being written; None where nobody says so.  log: messages in it."""

    rows: list[ServiceRow]
    recording: bool | None
    log: int
    pages: int


class Check(msgspec.Struct, frozen=True):
    """One thing to be right before measuring.  verdict: good, bad, or wait while it cannot be told."""

    name: str
    verdict: str
    words: str


class SettingUp(msgspec.Struct, frozen=True, tag="checks", tag_field="is"):
    """By viewer; advice: what to do next, of the whole rig."""

    viewers: dict[str, list[Check]]
    advice: str


class PostureShape(msgspec.Struct, frozen=True, tag="posture", tag_field="is"):
    """label: empty when no model explains it.  likeliest: the best models and their log-likelihoods, best first."""

    label: str
    margin: float
    likeliest: list[tuple[str, float]]


class Takes(msgspec.Struct, frozen=True, tag="takes", tag_field="is"):
    """The takes that can be played, newest first: name and size."""

    takes: list[tuple[str, float]]


class Player(msgspec.Struct, frozen=True, tag="player", tag_field="is"):
    """The take that is being played; an empty name for none.  problem: why it is not."""

    take: str
    place_s: float = 0.0
    duration_s: float = 0.0
    rate: float = 1.0
    paused: bool = False
    problem: str = ""


class Notice(msgspec.Struct, frozen=True, tag="notice", tag_field="is"):
    """A line for the person."""

    text: str


Shown: TypeAlias = (
    Hello | BodyShape | PoseShape | PointsShape | CameraShape | ViewShape | PreviewShape | Rows | SettingUp
    | PostureShape | Takes | Player | Notice
)  # fmt: skip

TakeName = Annotated[str, Meta(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.\-]{0,200}\.mcap$")]


class Ask(msgspec.Struct, frozen=True, tag="ask", tag_field="is", forbid_unknown_fields=True):
    """To the services of the rig."""

    what: Literal["measure", "record", "stop_recording"]


class Got(msgspec.Struct, frozen=True, tag="got", tag_field="is", forbid_unknown_fields=True):
    """The page has shown a list of pieces, and may be sent another."""


class Watch(msgspec.Struct, frozen=True, tag="watch", tag_field="is", forbid_unknown_fields=True):
    """What this page shows: what happens now, or the take that is being played."""

    feed: Feed


class ListTakes(msgspec.Struct, frozen=True, tag="list", tag_field="is", forbid_unknown_fields=True):
    pass


class Play(msgspec.Struct, frozen=True, tag="play", tag_field="is", forbid_unknown_fields=True):
    take: TakeName


class Control(msgspec.Struct, frozen=True, tag="control", tag_field="is", forbid_unknown_fields=True):
    """Of the take that is being played.  None leaves a thing as it is."""

    paused: bool | None = None
    place_s: Annotated[float, Meta(ge=0, le=1e6)] | None = None
    rate: Annotated[float, Meta(ge=0.05, le=100)] | None = None
    stop: bool = False


Wish: TypeAlias = Ask | Got | Watch | ListTakes | Play | Control
_wishes = msgspec.json.Decoder(Wish)
encode = msgspec.json.Encoder().encode


def wish_of(text: str | bytes) -> Wish:
    """What a page asks for.  Raises ValueError for anything else."""
    try:
        wish: Wish = _wishes.decode(text)
    except msgspec.MsgspecError as error:
        raise ValueError(f"a page asks for what there is not: {error}") from error
    return wish
