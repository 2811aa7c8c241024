"""Messages between the page of postures and its server, as JSON; times are seconds."""

from typing import Annotated, Literal, TypeAlias

import msgspec
from msgspec import Meta

from zenocap.common.web.messages import Decoder
from zenocap.services.animator.page.page_messages import BodyUpdate


class TakeEntry(msgspec.Struct, frozen=True):
    """A take: its name, begin and end, and what is needed to read its poses, see `motion_view.MotionView.chunk`.

    curve: speeds, rad/s, evenly spaced; -1 without a pose.  top: the largest.  pose_s: times of the poses that are sent, as
    begin, and time from one to the next.
    """

    name: str
    start_s: float
    end_s: float
    curve: list[float]
    top: float
    poses: int
    chunk_poses: int
    pose_start_s: float
    pose_step_s: float
    position_scale: float
    quaternion_scale: float
    body: BodyUpdate


class TeachHelloUpdate(msgspec.Struct, frozen=True, tag="hello", tag_field="type"):
    """The takes and files of the page.  background: its posture.  least_s: of a label.  warnings: lines for the user.

    rig: name of the rig of the live trial, "" without one.
    """

    version: str
    manifest: str
    model: str
    takes: list[TakeEntry]
    background: str
    least_s: float
    warnings: list[str]
    rig: str = ""


class PosesUpdate(msgspec.Struct, frozen=True, tag="poses", tag_field="type"):
    """A chunk of poses, base64."""

    take: int
    chunk: int
    data: bytes


class LabelEntry(msgspec.Struct, frozen=True):
    """A label.  end_s: end of the take for a row without one."""

    id: int
    take: int
    start_s: float
    end_s: float
    posture: str
    person: str


class LabelsUpdate(msgspec.Struct, frozen=True, tag="labels", tag_field="type"):
    """All labels of the takes of the page.

    elsewhere: rows of the manifest of other sources.  names: of postures, to complete.  undo, redo: whether there is any.
    people: of each take, for new labels.
    """

    labels: list[LabelEntry]
    elsewhere: int
    names: list[str]
    people: list[str]
    undo: bool
    redo: bool


class Proposal(msgspec.Struct, frozen=True):
    """A movement between two pauses.  suggestion: of a model, "" without one.  sure: the model accepts it."""

    start_s: float
    end_s: float
    limbs: list[str]
    suggestion: str
    sure: bool


class ProposalsUpdate(msgspec.Struct, frozen=True, tag="proposals", tag_field="type"):
    """Proposals of every take.  by: the model that suggests names, "" without one."""

    takes: list[list[Proposal]]
    by: str


class PostureRow(msgspec.Struct, frozen=True):
    """Examples of a posture, those that could be held out, and those of them that were recognized."""

    posture: str
    examples: int
    people: int
    tested: int
    right: int


class TrainingUpdate(msgspec.Struct, frozen=True, tag="training", tag_field="type"):
    """State of training.  done, of: steps of the current stage, `text`.  command: for live use.

    outdated: the labels have changed since.
    """

    state: Literal["none", "running", "done", "failed"]
    text: str = ""
    done: int = 0
    of: int = 0
    lines: list[str] = []
    postures: list[PostureRow] = []
    command: str = ""
    outdated: bool = False


class FoundEntry(msgspec.Struct, frozen=True):
    start_s: float
    end_s: float
    posture: str
    confidence: float
    verdict: Literal["right", "wrong", "unlabelled"]


class TrialUpdate(msgspec.Struct, frozen=True, tag="trial", tag_field="type"):
    """Postures that the model recognizes in a take.  missed: ids of labels that it does not."""

    take: int
    found: list[FoundEntry]
    missed: list[int]
    lines: list[str]


class LiveEntry(msgspec.Struct, frozen=True):
    """A posture of the running rig.  number: counts them.  confidence: 0 to 1.  duration_s: of the movement."""

    number: int
    posture: str
    confidence: float
    duration_s: float


class LiveUpdate(msgspec.Struct, frozen=True, tag="live", tag_field="type"):
    """State of the live trial, its latest postures, newest first, and how often each was recognized."""

    state: Literal["off", "running", "failed"]
    text: str = ""
    found: list[LiveEntry] = []
    counts: list[tuple[str, int]] = []


class PagesUpdate(msgspec.Struct, frozen=True, tag="pages", tag_field="type"):
    """Number of open pages."""

    pages: int


Seconds = Annotated[float, Meta(ge=0, le=1e6)]
Text = Annotated[str, Meta(max_length=200)]
Index = Annotated[int, Meta(ge=0, le=1 << 30)]


class AskPoses(msgspec.Struct, frozen=True, tag="poses", tag_field="type", forbid_unknown_fields=True):
    """Send a chunk of poses to this page."""

    take: Index
    chunk: Index


class AddLabel(msgspec.Struct, frozen=True, tag="add", tag_field="type", forbid_unknown_fields=True):
    take: Index
    start_s: Seconds
    end_s: Seconds
    posture: Text


class ChangeLabel(msgspec.Struct, frozen=True, tag="change", tag_field="type", forbid_unknown_fields=True):
    id: Index
    start_s: Seconds
    end_s: Seconds
    posture: Text


class DeleteLabel(msgspec.Struct, frozen=True, tag="delete", tag_field="type", forbid_unknown_fields=True):
    id: Index


class SetPerson(msgspec.Struct, frozen=True, tag="person", tag_field="type", forbid_unknown_fields=True):
    """Set the person of a take."""

    take: Index
    person: Text


class Undo(msgspec.Struct, frozen=True, tag="undo", tag_field="type", forbid_unknown_fields=True):
    """Take the last change back, or with `redo` the last undo."""

    redo: bool = False


class Train(msgspec.Struct, frozen=True, tag="train", tag_field="type", forbid_unknown_fields=True):
    """Train a model of all rows of the manifest."""


class Try(msgspec.Struct, frozen=True, tag="try", tag_field="type", forbid_unknown_fields=True):
    """Recognize a take with the trained model."""

    take: Index


class TryLive(msgspec.Struct, frozen=True, tag="try_live", tag_field="type", forbid_unknown_fields=True):
    """Recognize the poses of the running rig with the trained model, or stop it."""

    on: bool


Command: TypeAlias = AskPoses | AddLabel | ChangeLabel | DeleteLabel | SetPerson | Undo | Train | Try | TryLive
decode_command = Decoder[Command](Command)
