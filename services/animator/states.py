"""Setup and state of the animator: the latest message of every key, and derived values."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from zenocap.common import messages as m
from zenocap.common import topics as t
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.camera.pinhole import Camera
from zenocap.common.observe.bodies import NO_BODIES, Bodies
from zenocap.common.observe.bodies import Source as Source

# Topics that the animator receives from a rig and the page shows of a take.
TOPICS = (
    t.SIGHTING, t.PARTIAL_BAP, t.SILHOUETTE, t.PREVIEW, t.CAMERA_ADVICE, t.CAMERA, t.UNIVERSAL_BDP, t.ASSIGNMENT,
    t.UNIVERSAL_BAP, t.TRACKER_BDP, t.TRACKER_POSE, t.SCENE_POINTS, t.HEALTH, t.POSTURE, t.COMMAND, t.FRAME_RATE,
    t.TRACKER_DETAIL,
)  # fmt: skip


@dataclass(frozen=True)
class AnimatorSetup:
    """Setup of the animator.  viewers: of the rig."""

    viewers: tuple[str, ...] = ()


@dataclass(frozen=True)
class ActorPose:
    """Pose of the virtual actor at one time.

    captured_ns: capture time on the integrator's clock.  received_ns: time of receipt on this machine's clock.
    lost: limbs, or "person", that are being relocalized; position and angles are then the last known ones.
    """

    frame: int
    captured_ns: int
    received_ns: int
    source: Source
    anatomy: Anatomy
    body: Bdp
    pose: Pose
    lost: tuple[str, ...] = ()


@dataclass(frozen=True)
class AnimatorState:
    """Latest values; bodies and actors by source, the others by viewer; the latest commands, oldest first.

    now_ns: this machine's clock.  unusable: number of valid messages that could not be used: a body or pose of an unknown
    anatomy, an impossible camera, or scene points of a wrong size.
    frame_rate, detail: of an overloaded rig, see `FrameRate` and `TrackerDetail`.
    start_ns: capture time of frame 0 of the viewers of the rig, None before they have sent it.
    """

    now_ns: int = 0
    bodies: Bodies = field(default_factory=lambda: NO_BODIES)
    actors: Mapping[Source, ActorPose] = field(default_factory=dict)
    silhouettes: Mapping[str, m.Silhouette] = field(default_factory=dict)
    sightings: Mapping[str, m.Sighting] = field(default_factory=dict)
    previews: Mapping[str, m.Preview] = field(default_factory=dict)
    advice: Mapping[str, m.CameraAdvice] = field(default_factory=dict)
    cameras: Mapping[str, Camera] = field(default_factory=dict)
    assignment: m.Assignment | None = None
    posture: m.Posture | None = None
    commands: tuple[m.CommandResult, ...] = ()
    points: m.ScenePoints | None = None
    frame_rate: m.FrameRate | None = None
    detail: float = 1.0
    start_ns: int | None = None
    unusable: int = 0
