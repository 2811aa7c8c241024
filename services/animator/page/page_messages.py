"""Messages between the animator and a page, as JSON; `static/*.js` is the other side.

Lengths are metres, angles degrees (for display), times milliseconds since the Unix epoch.  Coordinates are world
coordinates; quaternions are x, y, z, w.  Arrays are flat lists, part after part.
"""

from typing import Annotated, Literal, TypeAlias

import msgspec
from msgspec import Meta

from zenocap.common.web.messages import Decoder
from zenocap.services.animator.page.save_messages import CancelSaving, SaveFormat, SaveTake

Feed = Literal["live", "take"]
Numbers: TypeAlias = list[float]


class HelloUpdate(msgspec.Struct, frozen=True, tag="hello", tag_field="type"):
    """Rig and animator of the page.

    live: False on a page that shows only a take, without a rig.  commands: posture and target of the rig's commands.
    formats: that takes can be saved in, besides films and pictures.
    """

    rig: str
    method: str
    version: str
    viewers: list[str]
    live: bool = True
    commands: list[tuple[str, str]] = []
    formats: list[SaveFormat] = []


class BodyUpdate(msgspec.Struct, frozen=True, tag="body", tag_field="type"):
    """Shape of a body.  near, far: long and short radius of each part's ends.  markers: names of the joint centres."""

    source: str
    parts: list[str]
    lengths: Numbers
    near: Numbers
    far: Numbers
    markers: list[str]
    angles: list[str]
    height: float


class PoseUpdate(msgspec.Struct, frozen=True, tag="pose", tag_field="type"):
    """Pose of a body.  positions: near ends of the parts.  received_ms: time of receipt by the animator."""

    source: str
    frame: int
    captured_ms: float
    received_ms: float
    positions: Numbers
    quaternions: Numbers
    centres: Numbers
    angles: Numbers
    lost: list[str]


class DistancesUpdate(msgspec.Struct, frozen=True, tag="distances", tag_field="type"):
    """Mean distance of the joints from the simulated person by method, metres; see `simulated_truth`."""

    by_source: dict[str, float]


class PointsUpdate(msgspec.Struct, frozen=True, tag="points", tag_field="type"):
    """Scene points, encoded as in `zenocap.common.messages.ScenePoints`, base64."""

    data: bytes
    captured_ms: float


class CameraUpdate(msgspec.Struct, frozen=True, tag="camera", tag_field="type"):
    """Centre, and the corners of the image at 1 m depth (top left, top right, bottom right, bottom left)."""

    viewer: str
    name: str
    size: tuple[int, int]
    centre: Numbers
    corners: Numbers


class PartOutline(msgspec.Struct, frozen=True):
    """Convex outline of one body part in an image.  corners: x, y, pixels of the silhouette."""

    part: str
    corners: Numbers


class ViewUpdate(msgspec.Struct, frozen=True, tag="view", tag_field="type"):
    """Silhouette of a viewer, encoded as in `zenocap.common.messages.Silhouette`, and the model's outlines by source.

    data: base64.  role, scale: facade or flank, and perspective scaling factor, None without an assignment.
    score: matching score S of [Two-view Eq. 1] in this view, or None.
    """

    viewer: str
    size: tuple[int, int]
    region: tuple[int, int, int, int]
    data: bytes
    outlines: dict[str, list[PartOutline]]
    role: str
    score: float | None
    scale: float | None = None


class PreviewUpdate(msgspec.Struct, frozen=True, tag="preview", tag_field="type"):
    """Picture of a camera.  position_s: of the player at its time; None for one of a live rig, or of the take itself."""

    viewer: str
    jpeg: bytes
    position_s: float | None = None


class AdviceLine(msgspec.Struct, frozen=True):
    """A fault of a camera's images.  code: see `zenocap.common.messages.AdviceCode`.  found, change: text."""

    code: str
    found: str
    change: str


class AdviceUpdate(msgspec.Struct, frozen=True, tag="advice", tag_field="type"):
    """Faults of the images of a camera, the worst first; empty: all is right."""

    viewer: str
    lines: list[AdviceLine]


class ServiceRow(msgspec.Struct, frozen=True):
    """Status of one service.

    condition, silent_s: see `zenocap.services.animator.presence`.  phase, state: as in its health, empty before the first.
    latency_ms: age of its result when published, or None.  losses: see `described`.
    """

    name: str
    id: str
    condition: str
    silent_s: float
    phase: str
    state: str
    rate: float
    latency_ms: float | None
    losses: list[tuple[str, str, int, int]]
    offset_ms: float | None
    memory_mb: float


class ServicesUpdate(msgspec.Struct, frozen=True, tag="services", tag_field="type"):
    """Status of all services.

    recording: whether a take is being written; None without a log.  log: messages in it.  pages: open pages.
    reduced: what is left out under overload; empty without.
    """

    services: list[ServiceRow]
    recording: bool | None
    log: int
    pages: int
    reduced: str = ""


class RecordingUpdate(msgspec.Struct, frozen=True, tag="recording", tag_field="type"):
    """The log of the live rig, also for pages that show a take.  recording, log: as in `ServicesUpdate`."""

    recording: bool | None
    log: int


class Check(msgspec.Struct, frozen=True):
    """One condition to be met before the body is measured.  verdict: good, bad, or wait while it is unknown."""

    name: str
    verdict: str
    text: str


class ChecksUpdate(msgspec.Struct, frozen=True, tag="checks", tag_field="type"):
    """Checks by viewer.  advice: next step of the set-up of the whole rig.  calm: nothing to be done."""

    viewers: dict[str, list[Check]]
    advice: str
    calm: bool


class PostureUpdate(msgspec.Struct, frozen=True, tag="posture", tag_field="type"):
    """Recognized posture, "" when no model explains the motion.  best: models and log-likelihoods, best first."""

    label: str
    margin: float
    best: list[tuple[str, float]]


class CommandRow(msgspec.Struct, frozen=True):
    """Command that a posture has triggered, see `zenocap.common.messages.CommandResult`.

    latency_ms: from the capture of the pose by which the posture was recognized to the action; since_end_ms,
    since_start_ms: from the posture's last and first frame.
    """

    number: int
    captured_ms: float
    posture: str
    action: str
    target: str
    confidence: float
    latency_ms: float
    since_end_ms: float
    since_start_ms: float
    outcome: str


class CommandsUpdate(msgspec.Struct, frozen=True, tag="commands", tag_field="type"):
    """Latest commands, oldest first.  live: False when they are sent to a page that has just opened."""

    commands: list[CommandRow]
    live: bool


class TakesUpdate(msgspec.Struct, frozen=True, tag="takes", tag_field="type"):
    """Takes that can be played, newest first: name and size in MB."""

    takes: list[tuple[str, float]]


class PlayerUpdate(msgspec.Struct, frozen=True, tag="player", tag_field="type"):
    """State of the player.  take: "" when none is played.  problem: why playing failed, or "" .

    pose_s: time from one pose of the take to the next, 0 where it is unknown.  opened: number of the take that is played,
    counted from the start of the page's program: another one means another take.
    """

    take: str
    position_s: float = 0.0
    duration_s: float = 0.0
    rate: float = 1.0
    paused: bool = False
    problem: str = ""
    pose_s: float = 0.0
    opened: int = 0


class PlaceUpdate(msgspec.Struct, frozen=True, tag="place", tag_field="type"):
    """Place in the take of the pose that is sent with it.  position_s: of the player.  frame: as recorded."""

    position_s: float
    frame: int


class VerdictPart(msgspec.Struct, frozen=True):
    """Part of a take in which its verdict is the same.  start_s, end_s: position of the player.  error: expected, metres.

    reasons: kinds, see `zenocap.common.messages.VerdictReason`.
    """

    start_s: float
    end_s: float
    rating: str
    error: float
    reasons: list[str]


class VerdictUpdate(msgspec.Struct, frozen=True, tag="verdict", tag_field="type"):
    """Verdict on the take that is played.  rating: "" for a take without one.  reasons: lines of text."""

    rating: str = ""
    reasons: list[str] = []
    parts: list[VerdictPart] = []


class PosturePart(msgspec.Struct, frozen=True):
    """A recognized posture.  start_s, end_s: position of the player."""

    start_s: float
    end_s: float
    label: str


class PosturesUpdate(msgspec.Struct, frozen=True, tag="postures", tag_field="type"):
    """The postures of the take that is played, in the order of the take."""

    parts: list[PosturePart] = []


class DroppedUpdate(msgspec.Struct, frozen=True, tag="dropped", tag_field="type"):
    """The take that was dropped on the page and is shown.  name: "" for none.  problem: why one could not be played."""

    name: str = ""
    problem: str = ""


class GhostUpdate(msgspec.Struct, frozen=True, tag="ghost", tag_field="type"):
    """Second take that the shown one is compared with.  alignment: how their times are matched, for the user."""

    take: str
    alignment: str
    body: BodyUpdate


class GhostPoseUpdate(msgspec.Struct, frozen=True, tag="ghost_pose", tag_field="type"):
    """Pose of the second take at the time of the shown one.

    pose: None where the second take has none.  distances: between the joint centres of both takes, metres, by the names of
    the joints that both have; empty where one has no pose.
    """

    pose: PoseUpdate | None
    distances: dict[str, float]


TakeName = Annotated[str, Meta(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.\-]{0,200}\.mcap$")]


class RigRequest(msgspec.Struct, frozen=True, tag="request", tag_field="type", forbid_unknown_fields=True):
    """A request to the services of the rig."""

    what: Literal["measure", "record", "stop_recording"]


class SelectFeed(msgspec.Struct, frozen=True, tag="select_feed", tag_field="type", forbid_unknown_fields=True):
    """Command to show the live rig, or the take that is being played."""

    feed: Feed


class ListTakes(msgspec.Struct, frozen=True, tag="list_takes", tag_field="type", forbid_unknown_fields=True):
    pass


class PlayTake(msgspec.Struct, frozen=True, tag="play_take", tag_field="type", forbid_unknown_fields=True):
    take: TakeName


class ControlPlayer(msgspec.Struct, frozen=True, tag="control_player", tag_field="type", forbid_unknown_fields=True):
    """Change the player; None leaves a value unchanged."""

    paused: bool | None = None
    position_s: Annotated[float, Meta(ge=0, le=1e6)] | None = None
    rate: Annotated[float, Meta(ge=0.05, le=100)] | None = None
    stop: bool = False


Command: TypeAlias = RigRequest | SelectFeed | ListTakes | PlayTake | ControlPlayer | SaveTake | CancelSaving
decode_command = Decoder[Command](Command)
