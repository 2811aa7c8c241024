"""Tracking of a rig's videos as a user asks for it: one pass or two, with pictures."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

from zenocap.common.formats.take_poses import summary_of
from zenocap.common.rig.rig import Rig
from zenocap.services.viewer.sources.source import frame_count
from zenocap.tools.takes.both_ways import track_both_ways
from zenocap.tools.takes.overlay import Overlay
from zenocap.tools.takes.track import Tracked, TrackedFrameSet, frame_sets_again, track

PICTURES = 20  # of an overlay, about
TRACKING = "tracking"


class Shown(Protocol):
    """Progress of the work, which is shown to the user.  activity: the part of it, in words."""

    activity: str

    def update(self, done: int, total: int | None = None, note: str = "") -> None: ...

    def restart(self, activity: str, total: int | None = None) -> None: ...


@dataclass
class TrackJob:
    """drawing: pictures to draw, None for none.  two_passes: whether to track backwards too.  jobs: number of cores.

    part: of the work that was reached; the take is complete after the forward pass.
    """

    rig: Rig
    drawing: Overlay | None
    two_passes: bool
    jobs: int | None
    part: Literal["forward", "second", "drawing"] = "forward"

    def run(self, take: Path, shown: Shown) -> Tracked:
        """Write the take, and draw it.  Raises as `track`."""
        self._shown, self._count = shown, 0
        if not self.two_passes:
            return track(self.rig, take, self._on_frame_set, self.jobs, self._on_repeat)
        result = track_both_ways(self.rig, take, self._on_frame_set, self._on_second_pass, self.jobs, self._on_repeat)
        if self.drawing is not None:
            self._draw(take, self.drawing, result)
        return result

    def _on_frame_set(self, frame_set: TrackedFrameSet) -> None:
        self._count += 1
        self._shown.activity = TRACKING
        if self.drawing is not None and not self.two_passes:
            self.drawing.add(frame_set)
        self._shown.update(self._count, note=frame_set.state)

    def _on_repeat(self, height: float) -> None:
        """Begin again, with an estimated height (m)."""
        self._count = 0
        self._shown.restart(f"{TRACKING} a person of {height:.2f} m", expected_frame_sets(self.rig))
        if self.drawing is not None:
            self.drawing.restart()

    def _on_second_pass(self, activity: str, done: int, total: int) -> None:
        if self._shown.activity != activity:
            self.part = "second"
            self._shown.restart(activity, total)
        self._shown.update(done)

    def _draw(self, take: Path, drawing: Overlay, result: Tracked) -> None:
        """Draw the frame sets, which are read again: the poses of both passes are known at the end of the second one."""
        self.part = "drawing"
        self._shown.restart("drawing", result.frame_sets)
        if result.both_ways:
            summary = summary_of(take)
            drawing.use_body(summary.anatomy, summary.bdp)
        for count, frame_set in enumerate(frame_sets_again(self.rig, take, self.jobs), 1):
            drawing.add(frame_set)
            self._shown.update(count)


def expected_frame_sets(rig: Rig) -> int | None:
    """Estimated number of frame sets in a rig's files; None when no file states its length."""
    counts = [count for count in map(frame_count, rig.viewers) if count]
    return max(counts) if counts else None


def overlay(rig: Rig, folder: Path, every: int | None) -> Overlay:
    """Pictures into that folder.  every: frames from one to the next; default: for about PICTURES.  Raises UserError."""
    return Overlay(rig, folder, every or max(1, (expected_frame_sets(rig) or PICTURES) // PICTURES))
