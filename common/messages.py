"""Messages on the bus, with units, frames and ranges; validated by `zenocap.common.codec`.

All messages carry `frame`, the source's frame number, and `captured_ns`, the capture time in nanoseconds since the Unix
epoch on the sender's clock.  Slopes and pixels are those of the level view (`common.camera.level_view`)
at the viewer's working size; silhouettes and previews are as the camera sees them.
"""

from enum import StrEnum
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

Metres = Annotated[float, Meta(ge=-1e3, le=1e3)]
Size = Annotated[float, Meta(ge=0, le=10)]  # metres
Radians = Annotated[float, Meta(ge=-50, le=50)]
Spread = Annotated[float, Meta(ge=0, le=100)]  # metres or radians
Score = Annotated[float, Meta(ge=0, le=1)]
LogScore = Annotated[float, Meta(ge=-1e3, le=1e3)]
Slope = Annotated[float, Meta(ge=-100, le=100)]  # pixels over focal length
Ratio = Annotated[float, Meta(ge=0, le=100)]
Count = Annotated[int, Meta(ge=0, le=2**53)]
DelayMs = Annotated[float, Meta(ge=0, le=1e5)]  # milliseconds
Nanoseconds = Annotated[int, Meta(ge=0, le=2**63 - 1)]  # msgspec refuses bounds beyond 64 bits
Number = Annotated[float, Meta(ge=-1e9, le=1e9)]  # finite: a range refuses NaN and infinity, a bare float does not
Name = Annotated[str, Meta(min_length=1, max_length=64, pattern=r"^[A-Za-z0-9_.\-]+(?!\n)$")]  # "$" alone allows "a\n"
# Never "..".
FolderName = Annotated[str, Meta(min_length=1, max_length=64, pattern=r"^[A-Za-z0-9_\-][A-Za-z0-9_.\-]*(?!\n)$")]
Text = Annotated[str, Meta(max_length=1000)]
Label = Annotated[str, Meta(min_length=1, max_length=64)]  # of a posture, in any script
Pixels = Annotated[int, Meta(ge=16, le=16384)]  # of an image, px
Point = tuple[Metres, Metres, Metres]
View = Literal["facade", "flank"]
Side = Literal["front", "side"]
SizePair = tuple[Size, Size]
SpreadTriple = tuple[Spread, Spread, Spread]
SizeTriple = tuple[Size, Size, Size]

SCHEMA_VERSION = 1
MOST_POINTS = 16384  # of one `ScenePoints`
FILM_PART_BYTES = 1 << 20  # of a film, in one reply
SENT = "sent."  # counts of a health: beginning of the numbers of messages sent, by name of the topic
PROCESS, ENDED = "process", "ended"  # random number of the process; 1 in its last health


class Message(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    frame: Count
    captured_ns: Nanoseconds
    version: Literal[1] = 1


class Body(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """BDP of one person: `zenocap.common.body.definition.Bdp` by name.  Without tips all parts are cylinders."""

    anatomy: Name
    sizes: Annotated[dict[Name, SizeTriple], Meta(max_length=64)]  # part: height, long radius, short radius, metres
    offsets: Annotated[dict[Name, Point], Meta(max_length=64)]  # joint: position in its parent part's frame, metres
    tips: Annotated[dict[Name, SizePair], Meta(max_length=64)] = {}  # part: long and short radius at its far end, metres
    bases: Annotated[dict[Name, Point], Meta(max_length=64)] = {}  # part: where its axis begins in its own frame, metres


class PartialBdp(Message, frozen=True, tag="partial_bdp"):
    """Body measures from one viewer in the initial posture.  [Two-view 2.4]"""

    viewer: Name
    side: Side
    lengths: Annotated[dict[Name, Size], Meta(max_length=32)]  # metres at this viewer's scale; `height` is t_n of 4.2


class UniversalBdp(Message, frozen=True, tag="universal_bdp"):
    body: Body
    ratio: Ratio  # r_t = t2 / t1 after both are brought to metres; 1 for a perfect calibration


class Sighting(Message, frozen=True, tag="sighting"):
    """The person's position in one view: slopes of the ray to the navel in its level view (x right, y down)."""

    viewer: Name
    present: bool
    x: Slope
    y: Slope
    height: Slope  # of the silhouette, as a slope
    width: Slope  # W_u-body, as a slope  [Two-view 3.1]
    view: View  # the viewer's own decision
    score: Score  # Eq. 1 of the shifted model
    tilt: Radians = 0.0  # turn of the torso about this view's axis since the universal BAP
    turns: Annotated[list[LogScore], Meta(max_length=16)] = []  # of the body turned about the vertical, see viewer.position
    toes: Metres = 0.0  # how far the feet reach past the shins to the right of the image
    arms: Annotated[list[LogScore], Meta(max_length=64)] = []  # of the ways the arms may be, see viewer.hypotheses
    legs: Annotated[list[LogScore], Meta(max_length=64)] = []  # the same of the legs
    based_on: Annotated[int, Meta(ge=-1, le=2**53)] = -1  # frame of the universal BAP that the model was placed by


class ViewAssignment(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    frame: Count  # of the viewer's own sighting that this answers
    view: View
    scale: Ratio  # r_t, size in this viewer's image against the origin of the action region  [Two-view Eq. 4]
    stale: bool  # this viewer's sighting is an old one


class Assignment(Message, frozen=True, tag="assignment"):
    """The integrator's answer to the sightings of one instant."""

    position: Point  # navel in the world
    yaw: Radians  # of the torso: from +Z towards +X
    lean: Radians  # of the torso: forward
    roll: Radians  # of the torso: to the person's right
    squatting: bool
    views: Annotated[dict[Name, ViewAssignment], Meta(max_length=64)]
    tracking: bool  # false before the universal BDP is known
    arms: Annotated[int, Meta(ge=0, le=63)] = 0  # the way the arms' searches begin from, see viewer.hypotheses
    legs: Annotated[int, Meta(ge=0, le=63)] = 0  # the same of the legs'


class LimbMatch(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Result of the search for one limb in one view."""

    score: Score  # Eq. 1 with the limb in its best place
    visible: Score  # how far the view shows the limb: its bare share that fits the silhouette
    matchings: Annotated[list[Count], Meta(max_length=64)]  # of each tri-tree search


class PartialBap(Message, frozen=True, tag="partial_bap"):
    """Joint angles from one viewer, by name (`navel.x`, `right_elbow.x`): only those that its view determines."""

    viewer: Name
    view: View
    angles: Annotated[dict[Name, Radians], Meta(max_length=64)]
    limbs: Annotated[dict[Name, LimbMatch], Meta(max_length=32)]
    exchange: LogScore  # gained if the legs exchanged their places; 0 in the flank, which cannot tell
    score: Score
    based_on: Annotated[int, Meta(ge=-1, le=2**53)] = -1


class UniversalBap(Message, frozen=True, tag="universal_bap"):
    position: Point  # navel in the world
    angles: Annotated[dict[Name, Radians], Meta(max_length=64)]  # every joint angle of the anatomy
    scores: Annotated[dict[Name, Score], Meta(max_length=64)]  # Eq. 1 by viewer
    views: Annotated[dict[Name, View], Meta(max_length=64)]
    stale: Annotated[list[Name], Meta(max_length=64)]  # viewers whose part is an old one
    lost: Annotated[list[Name], Meta(max_length=32)]  # limbs, or "person", that are being searched for again


class TrackerBdp(Message, frozen=True, tag="tracker_bdp"):
    """The body that the tracker fits to all views together.

    measured: False while it has not been measured in a T-pose, and began with average proportions.
    """

    body: Body
    measured: bool = True


class TrackerPose(Message, frozen=True, tag="tracker_pose"):
    """The tracker's estimate of one instant and the spread of its particles.  [Hybrid V]

    lost: the person is searched for; position and angles are then the last estimate.  views: the viewers whose
    silhouettes were used.  frame: the largest of theirs.  captured_ns: of the instant, on the integrator's clock.
    limbs: probability that elbow and wrist, or knee and ankle, are within 150 mm of the person's; empty while lost, and in
    takes of earlier versions.  lost_limbs: those below one half.  heading: probability that front and back are not
    exchanged; null where unknown.
    """

    position: Point  # navel in the world
    angles: Annotated[dict[Name, Radians], Meta(max_length=64)]  # every joint angle of the anatomy
    position_spread: SpreadTriple  # standard deviations over the weighted particles, metres
    spread: Annotated[dict[Name, Spread], Meta(max_length=64)]  # the same of every joint angle, radians
    likelihood: Number  # of the estimate  [Hybrid Eq. 29-31]
    effective: Annotated[float, Meta(ge=0, le=1e6)]  # particles' effective number, 1 / sum of squared weights
    lost: bool
    views: Annotated[list[Name], Meta(max_length=64)]
    limbs: Annotated[dict[Name, Score], Meta(max_length=32)] = {}
    lost_limbs: Annotated[list[Name], Meta(max_length=32)] = []
    heading: Score | None = None


class BothWaysPose(TrackerPose, frozen=True, kw_only=True, tag="both_ways_pose"):
    """Pose of a recorded instant from tracking it forwards and backwards in time; one for each `TrackerPose` of the take.

    spread, likelihood, effective: of the forward pass.  lost: in both directions.
    limbs, lost_limbs, heading: of the pass whose pose was taken; earlier versions state those of the forward pass only.
    """

    backward: Annotated[dict[Name, Score], Meta(max_length=16)]  # share of the backward pass by section of the body


Rating = Literal["good", "doubtful", "unusable"]


class VerdictReason(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What makes a take less than good.  kind: for programs.  text: for people, with what to change."""

    kind: Name
    viewers: Annotated[list[Name], Meta(max_length=64)] = []
    text: Text


class VerdictStretch(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """About a second of a take in which the person is in view.  reasons: kinds."""

    start_ns: Nanoseconds
    end_ns: Nanoseconds
    rating: Rating
    error: Size  # expected mean error of the joints, metres; 0.5 without a pose
    lost: Score  # share of its frames without a pose
    reasons: Annotated[list[Name], Meta(max_length=16)] = []


class Verdict(Message, frozen=True, tag="verdict"):
    """Whether the poses of a take can be used, computed without truth; the last message of a take that was tracked offline.

    good: meant for a mean error of the joints of up to 75 mm, with up to 5 % of them lost.  unusable: no pose, more than
    150 mm, or more than 25 % lost.  doubtful: between, or without silhouettes to check.
    evidence: what it rests on.  frame, captured_ns: of the last pose; 0 without poses.
    """

    rating: Rating
    error: Size  # expected mean error of the joints over the stretches, metres
    evidence: Literal["both-ways", "one-pass", "two-view", "poses-only", "none"]
    reasons: Annotated[list[VerdictReason], Meta(max_length=64)]
    stretches: Annotated[list[VerdictStretch], Meta(max_length=2**20)]

    @property
    def text(self) -> str:
        """Lines for people: the class with the expected error, and every reason, whose control characters are escaped."""
        error = "" if self.evidence == "none" else f": expected error of the joints {1000 * self.error:.0f} mm"
        reasons = ["".join(c if c.isprintable() else repr(c)[1:-1] for c in reason.text) for reason in self.reasons]
        return "\n  ".join([f"verdict: {self.rating}{error}", *reasons])


class ScenePoints(Message, frozen=True, tag="scene_points"):
    """Points of the visual hull of one instant.  [Hybrid III]

    points: x, y, z of each, little-endian 16-bit integers, millimetres in the world.  frame, captured_ns: as of the pose.
    """

    points: Annotated[bytes, Meta(max_length=6 * MOST_POINTS)]


class Posture(Message, frozen=True, tag="posture"):
    """Posture between two moments on the integrator's clock.  [Two-view 5.2]

    label: None when it is none of the postures.  log_likelihoods: by label, natural logarithm of P(O | model) of the whole
    segment, or of the share of votes of a forest.
    score: how much better than the background the best label explains a frame of the model's rate, natural logarithm; of a
    forest, -ln(1 - s) of its share of votes s.  margin: how much better than the second best, in the same unit; of a
    forest, -ln(1 - s + t) with the share t of the second best; 0 where there is one model.
    frame, captured_ns: of the pose by which the answer was known, so that captured_ns - end_ns is what it took.
    """

    label: Label | None
    start_ns: Nanoseconds
    end_ns: Nanoseconds
    log_likelihoods: Annotated[dict[Label, Number], Meta(max_length=256)]
    score: Number
    margin: Annotated[float, Meta(ge=0, le=1e9)]


class CommandResult(Message, frozen=True, tag="command_result"):
    """A command of the rig that a posture triggered, and what became of it.

    frame: counts from 0.  captured_ns: of the pose by which the posture was recognized, on the integrator's clock.
    action, target: as in the rig file.  confidence: of the posture.
    latency_ns: from captured_ns to the action: put, datagram or request sent, program started; or to its failure.
    since_end_ns, since_start_ns: the same from the last and from the first frame of the posture.
    outcome: "dropped" when too many earlier ones of the same command were waiting.  error: empty when it is done.
    """

    posture: Label
    action: Literal["zenoh", "osc", "udp", "http", "program"]
    target: Text
    confidence: Score
    latency_ns: Nanoseconds
    since_end_ns: Nanoseconds
    since_start_ns: Nanoseconds
    outcome: Literal["done", "failed", "dropped"]
    error: Text = ""


class Silhouette(Message, frozen=True, tag="silhouette"):
    """A binary mask: byte 1, then zlib of the region's rows, each as its difference from the one above, 8 pixels a byte."""

    viewer: Name
    size: tuple[Annotated[int, Meta(ge=1, le=16384)], Annotated[int, Meta(ge=1, le=16384)]]  # width, height
    region: tuple[Count, Count, Count, Count]  # left, top, width, height of the packed part
    data: Annotated[bytes, Meta(max_length=4 << 20)]


class Preview(Message, frozen=True, tag="preview"):
    viewer: Name
    jpeg: Annotated[bytes, Meta(max_length=1 << 20)]


class AdviceCode(StrEnum):
    """What is wrong with the images of a camera.  Sentences and units: `zenocap.common.camera_advice`."""

    CONTRAST = "contrast"  # the person hardly differs from the room
    HOLES = "holes"  # in the silhouette
    GLOSSY_FLOOR = "glossy_floor"  # the floor mirrors the person
    CUT_OFF = "cut_off"  # the border of the image cuts the person off
    SMALL = "small"  # the person has few pixels
    LIGHT_DRIFT = "light_drift"  # exposure or light changes
    WHITE_BALANCE = "white_balance"  # colours change
    FLICKER = "flicker"  # lamps and shutter differ in frequency
    DARK = "dark"
    SATURATED = "saturated"
    FOCUS = "focus"  # the whole image is soft
    MOTION_BLUR = "motion_blur"  # what moves is soft
    OCCUPIED = "occupied"  # a person is in the images of the empty scene
    UNCOVERED = "uncovered"  # a person was in all of them, and has left a place
    PEOPLE = "people"  # another person is in the image


Third = Literal["", "upper", "middle", "lower"]  # of the silhouette, by height; "" for what is not of a part


class CameraFault(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """value: measured, in `unit`.  limit: from where it is a fault.  part: third of the silhouette.

    unit: "levels" of 255; "%" of what the code is about, see docs/cameras.md; "px" at the working size.
    """

    code: AdviceCode
    value: Number
    limit: Number
    unit: Literal["levels", "%", "px"]
    part: Third = ""


class CameraAdvice(Message, frozen=True, tag="camera_advice"):
    """What a viewer found to be wrong with its own images, the worst first; no faults: all is right.

    Measured about once a second over the last seconds, once the background is learnt.
    """

    viewer: Name
    faults: Annotated[list[CameraFault], Meta(max_length=16)] = []


class CameraInfo(Message, frozen=True, tag="camera"):
    """Calibration of a viewer's camera in the Y-up world, OpenCV convention, row by row."""

    viewer: Name
    name: Name
    size: tuple[Count, Count]
    matrix: Annotated[list[Number], Meta(min_length=9, max_length=9)]
    distortions: Annotated[list[Number], Meta(max_length=14)]
    rotation: Annotated[list[Number], Meta(min_length=9, max_length=9)]
    translation: Annotated[list[Number], Meta(min_length=3, max_length=3)]


class Phase(StrEnum):
    """What a service is doing, for programs.  Which service is in which phase when, is decided by its `phase_of`."""

    UNKNOWN = "unknown"  # takes of 0.2 have no phase
    RUNNING = "running"  # a service without phases of its own: animator, recorder, recognizer, clock and log
    LEARNING_BACKGROUND = "learning_background"  # viewer
    SEGMENTING = "segmenting"  # viewer of a rig with a tracker: silhouettes of a person
    WAITING_FOR_INPUT = "waiting_for_input"  # no silhouettes or poses yet, or of too few viewers
    AWAITING_PERSON = "awaiting_person"  # no person in view, or not in the initial posture yet
    MEASURING_BODY = "measuring_body"
    TRACKING = "tracking"
    LOST = "lost"  # the body is known, the person is searched for


class Health(Message, frozen=True, tag="health"):
    service: Name
    id: Name
    state: Text  # what it is doing, for people
    rate: Annotated[float, Meta(ge=0, le=1e6)]  # frames per second over the last second
    stages_ms: Annotated[dict[Name, Annotated[float, Meta(ge=0, le=1e6)]], Meta(max_length=32)]  # medians
    counts: Annotated[dict[Name, Count], Meta(max_length=64)]  # dropped, rejected, late, ...
    clock_offset_ns: Annotated[int, Meta(ge=-(2**62), le=2**62)] = 0  # this clock minus the integrator's
    clock_error_ns: Nanoseconds = 0  # half the shortest round trip
    memory_bytes: Count = 0
    cores: Annotated[float, Meta(ge=0, le=1e4)] = 0.0  # processor time of this process over the last second, per second
    busy: Score = 0.0  # share of the last second that the one loop spent on steps and publishing: 1 is its limit
    phase: Phase = Phase.UNKNOWN  # what it is doing, for programs


class Handled(Message, frozen=True, tag="handled"):
    """Input trace of a service's step, in order: a take is recomputed from it.  `frame` counts from 0.

    first: events before these since its start.  keys: what came: a message's key, "frame" of the own source, "tick",
    "alive/SERVICE/ID", "gone/SERVICE/ID".  events: index into `keys`, and the capture time, or the time of what has none.
    """

    service: Name
    id: Name
    first: Count
    keys: Annotated[list[Text], Meta(max_length=256)]
    events: Annotated[list[tuple[Count, Nanoseconds]], Meta(max_length=256)]


class FrameRate(Message, frozen=True, tag="frame_rate"):
    """The instants that all viewers of a rig process, decided by the integrator: see `common.runtime.frame_rate`.

    Instants are numbered by capture time on the integrator's clock, in frame periods of the rig: number n is at n / fps s
    plus phase_ns.  Of every `of` of them `keep` are processed, evenly spread, at capture times from `from_ns`; before that
    time the decision before holds.  `frame` counts from 0.  captured_ns: of the decision.  fps: of the rig.
    limit: what is too slow, empty at the full rate.  viewers: those that lost frames.
    """

    keep: Annotated[int, Meta(ge=1, le=1000)]
    of: Annotated[int, Meta(ge=1, le=1000)]
    from_ns: Nanoseconds
    phase_ns: Nanoseconds
    fps: Annotated[float, Meta(ge=1e-3, le=1e4)]
    limit: Literal["", "viewers", "tracker"] = ""
    viewers: Annotated[list[Name], Meta(max_length=64)] = []


class CameraDelays(Message, frozen=True, tag="camera_delays"):
    """Time by which the images of each camera are older than their capture times say, found from silhouettes of a person.

    `frame` counts from 0; captured_ns: of the decision.  found_ms: by viewer, 0 for the youngest images; errors_ms: their
    standard errors; both of the viewers that were certain.  uncertain: viewers for which the last estimate found none.
    applied_ms: what the tracker subtracts from capture times now; empty unless the rig has `delays = "follow"`.
    """

    found_ms: Annotated[dict[Name, DelayMs], Meta(max_length=64)]
    errors_ms: Annotated[dict[Name, DelayMs], Meta(max_length=64)]
    uncertain: Annotated[list[Name], Meta(max_length=64)]
    applied_ms: Annotated[dict[Name, DelayMs], Meta(max_length=64)]


class TrackerDetail(Message, frozen=True, tag="tracker_detail"):
    """Share of its points and particles that an overloaded tracker uses; `frame` counts from 0."""

    share: Annotated[float, Meta(ge=0.1, le=1)]


class Request(Message, frozen=True, tag="request"):
    """A user's request to the services, as from the page.  It is recorded, so that its effects can be recomputed."""

    what: Literal["measure", "record", "stop_recording"]  # measure the body again; start a take; end it


class ClockQuery(Message, frozen=True, tag="clock_query"):
    """A round trip for the clock offset; the reply's `captured_ns` is the integrator's clock."""

    captured_ns: Annotated[int, Meta(ge=0, le=2**62)]  # so that the offset is one of a `Health`


class ServiceInfo(Message, frozen=True, tag="about"):
    """Rig and versions of a service; the reply to a query, not a published message.

    digest: of the rig file and the calibration, equal on every machine of a rig.  versions: by package.
    """

    service: Name
    id: Name
    host: Text
    digest: Text
    versions: Annotated[dict[Name, Text], Meta(max_length=32)]


class PaceQuery(Message, frozen=True, tag="pace_query"):
    """Flow control: the service replies once it has handled everything sent to it before."""

    sent: Annotated[dict[Text, Count], Meta(max_length=256)] = {}  # by key since the last question; back: those listened to


class FilmBoard(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A printed board, by the options of `zenocap calibrate detect`; None where an option is left out."""

    kind: Literal["charuco", "chessboard", "aprilgrid"]
    columns: Annotated[int, Meta(ge=2, le=40)]
    rows: Annotated[int, Meta(ge=2, le=40)]
    square_mm: Annotated[float, Meta(ge=2, le=1000)]
    marker_mm: Annotated[float, Meta(ge=0, le=1000)] | None = None
    dictionary: Name | None = None
    spacing: Annotated[float, Meta(ge=0, le=1)] | None = None


class FilmQuery(Message, frozen=True, tag="film_query"):
    """A query of the one who films, to the program that has a camera; answered by a `FilmReply`.

    state: asks only.  open: begin to take images, for the film of that name.  start: record those captured from `begin_ns`
    on, for `duration_ns` (0: until stopped).  stop: end, also a film that has not begun.  files: sizes and checksums of
    an ended film, or of its corners.  read: a part of one of its files.  detect: search `board` in an ended film, for its
    corners.  Times are by the clock of the one who is asked.
    """

    what: Literal["state", "open", "start", "stop", "files", "read", "detect"]
    sender: Name  # random for each film: only its sender is obeyed.  No secret on an open network: all can receive queries
    film: FolderName | None = None  # None: for "state" only
    camera: FolderName | None = None  # name of the camera in the rig, for "open": the name of its files
    begin_ns: Nanoseconds = 0
    duration_ns: Nanoseconds = 0
    file: Literal["video", "times", "corners"] = "video"
    offset: Count = 0  # bytes, for "read"
    size: tuple[Pixels, Pixels] = (1280, 720)  # for a camera host
    fps: Annotated[float, Meta(ge=0.1, le=1000)] = 30.0  # for a camera host
    settings: Annotated[dict[Name, Text], Meta(max_length=8)] = {}  # of a camera without rig file, for a camera host
    board: FilmBoard | None = None  # for "detect"


class FilmFile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """bytes: size.  sha256: of the whole file, hexadecimal; empty while it is being computed."""

    bytes: Count
    sha256: Annotated[str, Meta(max_length=64)] = ""


class FilmReply(Message, frozen=True, tag="film_reply"):
    """State of the camera's film after the query.  `captured_ns` is the clock of the one who answers."""

    host: Text  # name of the machine
    state: Literal["idle", "opening", "ready", "filming", "ended"]
    refused: Text = ""  # why the query was not obeyed
    failure: Text = ""  # why the film ended early
    film: FolderName | None = None
    folder: Text = ""  # of the film, on its machine
    may_film: bool = False  # whether the program was started with permission
    may_read: bool = False  # whether pictures may leave the machine
    frames: Count = 0
    lost: Count = 0  # frames that the writer could not take
    away: Count = 0  # how often the camera failed and was opened again
    first_ns: Nanoseconds = 0  # capture times of the first and the last frame
    last_ns: Nanoseconds = 0
    written_bytes: Count = 0
    free_bytes: Count = 0  # of the disk
    files: Annotated[dict[Literal["video", "times", "corners"], FilmFile], Meta(max_length=3)] = {}
    data: Annotated[bytes, Meta(max_length=FILM_PART_BYTES)] = b""  # reply to "read"
    board: Literal["none", "searching", "found", "failed"] = "none"  # of "detect"
    board_failure: Text = ""  # why it was not found


class HostCamera(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A camera of a camera host.  source: as in a rig file, without password; stays the same where `stable`."""

    id: Name  # in the keys of its host
    source: Text
    name: Text = ""
    stable: bool = False
    modes: Annotated[list[Text], Meta(max_length=48)] = []
    used_by: Text = ""  # the viewer that it was assigned to, such as "viewer left of rig studio"


class CameraHost(Message, frozen=True, tag="camera_host"):
    """Cameras of a machine on which `zenocap viewer --discover` runs; the reply to a query."""

    machine: Name
    host: Text
    cameras: Annotated[list[HostCamera], Meta(max_length=16)]
    instance: Name = "-"  # chosen at random by each process: two machines of one name differ in it


class HostedLens(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A fisheye lens, as `zenocap.common.camera.fisheye.FisheyeLens`."""

    size: tuple[Pixels, Pixels]
    matrix: Annotated[list[Number], Meta(min_length=9, max_length=9)]  # px, row by row
    coefficients: Annotated[list[Number], Meta(min_length=4, max_length=4)]


class HostedViewer(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A viewer for a camera of a camera host: calibration, as in `CameraInfo`, and settings.  Contains no path."""

    id: Name
    camera: FolderName  # name of the camera in the calibration
    calibrated_size: tuple[Pixels, Pixels]
    size: tuple[Pixels, Pixels]  # working size, of the calibration below
    matrix: Annotated[list[Number], Meta(min_length=9, max_length=9)]
    distortions: Annotated[list[Number], Meta(max_length=14)]
    rotation: Annotated[list[Number], Meta(min_length=9, max_length=9)]
    translation: Annotated[list[Number], Meta(min_length=3, max_length=3)]
    fisheye: HostedLens | None = None
    fps: Annotated[float, Meta(ge=0.1, le=1000)]
    rig_fps: Annotated[float, Meta(ge=0.1, le=1000)]  # of the slowest viewer of the rig
    background: Literal["first", "median", "mog2", "adaptive"] = "first"
    empty_frames: Annotated[int, Meta(ge=1, le=10_000)] = 60  # for "first"
    preview: bool = False  # without effect where pictures may not leave the machine
    silhouette: bool = True
    settings: Annotated[dict[Name, Text], Meta(max_length=8)] = {}  # of the camera, as in `FilmQuery`


class AssignQuery(Message, frozen=True, tag="assign_query"):
    """A query of a rig's launcher to a camera host, about one of its cameras; answered by an `AssignReply`.

    state: asks only.  assign: run the viewer; to be repeated, otherwise the viewer ends.  release: end it.
    """

    what: Literal["state", "assign", "release"]
    rig: Name
    digest: Name = "-"  # of the rig file and the calibration, see `ServiceInfo`
    tracker: bool = True  # whether a tracker uses the silhouettes; false for the method two-view
    additions: Annotated[list[Name], Meta(max_length=32)] = []  # to two-view, see `zenocap.common.rig.two_view`
    viewer: HostedViewer | None = None  # for "assign"


class AssignReply(Message, frozen=True, tag="assign_reply"):
    """State of the assignment after the query.  `captured_ns` is the clock of the one who answers."""

    host: Text  # name of the machine
    state: Literal["free", "running", "waiting"]  # waiting: the viewer failed and will be started again
    refused: Text = ""  # why the query was not obeyed
    failure: Text = ""  # last output of a viewer that failed
    rig: Name | None = None  # whose viewer has the camera
    viewer: Name | None = None
    restarts: Count = 0
    previews: bool = False  # whether small pictures may leave the machine
