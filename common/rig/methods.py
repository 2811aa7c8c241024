"""The table of methods: how a rig finds the pose of a person."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

from zenocap.common import topics
from zenocap.common.table import Table
from zenocap.common.topics import Topic

MOST_VIEWS = 64  # of a method for any number of cameras: what a pose message can name


@dataclass(frozen=True)
class Method:
    """poses, body: topics of its result.  pose_service: name of the service that publishes it.

    views: fewest and most cameras.  viewer, pose: factories, "module:function": of the service of a viewer, called with
    rig, viewer, network for people and kept background; of the pose service, called with the rig.
    sends: topics of its viewers, the one of every frame first.
    table: name of its table in the rig file, None without one.  second_pass: whether a take can be tracked backwards too;
    "default": and is, unless its preset is another one.  recomputes_viewers: whether a take holds all inputs of a viewer.
    recomputes_pose: whether `zenocap verify` knows its pose service, and not only a package.
    exchange: whether its viewers and its integrator run the exchange of [Two-view], also beside a tracker.
    tracker: method of its tracker where that is another row's.
    viewer_warmup, pose_warmup: parts of `zenocap warmup` of a viewer, besides silhouettes, and of the pose service.
    """

    name: str
    poses: Topic
    body: Topic
    pose_service: Literal["integrator", "tracker"]
    views: tuple[int, int]
    viewer: str
    pose: str
    sends: tuple[Topic, ...]
    table: str | None = None
    second_pass: Literal["never", "possible", "default"] = "never"
    recomputes_viewers: bool = False
    recomputes_pose: bool = False
    viewer_warmup: tuple[str, ...] = ()
    pose_warmup: tuple[str, ...] = ()
    exchange: bool = False
    tracker: str = ""

    @cached_property
    def has_tracker(self) -> bool:
        return self.pose_service == "tracker"

    @cached_property
    def tracker_method(self) -> str:
        """Method of the tracker's settings and filter."""
        return self.tracker or self.name

    @cached_property
    def only_silhouettes(self) -> bool:
        """Whether its viewers publish silhouettes alone, and await no answer to a frame."""
        return self.has_tracker and not self.exchange


def _with_tracker(name: str, second_pass: Literal["possible", "default"] = "possible") -> Method:
    """A method of the tracker, which gets silhouettes."""
    return Method(
        name, topics.TRACKER_POSE, topics.TRACKER_BDP, "tracker", (2, MOST_VIEWS),
        "zenocap.services.viewer.shell:silhouettes", "zenocap.services.tracker.shell:tracker_service",
        (topics.SILHOUETTE,), "tracker", second_pass, recomputes_pose=True, pose_warmup=("tracker",),
    )  # fmt: skip


TWO_VIEW = Method(
    "two-view", topics.UNIVERSAL_BAP, topics.UNIVERSAL_BDP, "integrator", (2, 2),
    "zenocap.services.viewer.two_view.shell:two_view", "zenocap.services.integrator.shell:integrator_service",
    (topics.SIGHTING, topics.PARTIAL_BAP, topics.PARTIAL_BDP), recomputes_viewers=True, recomputes_pose=True,
    viewer_warmup=("tracking",), pose_warmup=("tracking",), exchange=True,
)  # fmt: skip
HYBRID = _with_tracker("hybrid", "default")
IMAGE_FORCE = _with_tracker("image-force")
PARTICLE_FILTER = _with_tracker("particle-filter")
# Paper (added): both papers' systems at once, the tracker on the silhouettes of the two viewers.
BOTH = replace(
    HYBRID, name="both", views=TWO_VIEW.views, viewer=TWO_VIEW.viewer, sends=(*TWO_VIEW.sends, *HYBRID.sends),
    second_pass="possible", recomputes_viewers=True, viewer_warmup=TWO_VIEW.viewer_warmup, exchange=True, tracker="hybrid",
)  # fmt: skip

METHODS = Table(
    Method,
    "zenocap.methods",
    {
        "two-view": f"{__name__}:TWO_VIEW",
        "hybrid": f"{__name__}:HYBRID",
        "image-force": f"{__name__}:IMAGE_FORCE",
        "particle-filter": f"{__name__}:PARTICLE_FILTER",
        "both": f"{__name__}:BOTH",
    },
)
AUTO = "auto"  # the hybrid method, or two-view where a variant of it is asked for


def method_of(name: str) -> Method:
    """Row of a method.  Raises UserError."""
    return METHODS.row(name)


def tracker_methods() -> tuple[str, ...]:
    """Names of the methods whose pose comes from the tracker."""
    return tuple(name for name, method in METHODS.rows().items() if method.has_tracker)
