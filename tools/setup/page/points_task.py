"""Task of the page of points: points, picks and measures at one moment, and the result."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from zenocap.common.camera.pinhole import Camera
from zenocap.common.errors import UserError
from zenocap.tools.setup.page.point_messages import FieldRow, PlacedView, PointTask

Pixel = tuple[float, float]
Size = tuple[int, int]
Place = tuple[float | None, float | None, float | None]


@dataclass(frozen=True)
class Placed:
    """points: places, m.  fields: measured quantities by key.  picks: px, by camera and point.

    sizes: of the pictures, px, of cameras that have one.  picked_sizes: of the pictures in which the picks were placed.
    """

    points: Mapping[str, Place]
    fields: Mapping[str, float | None] = field(default_factory=dict)
    picks: Mapping[str, Mapping[str, Pixel]] = field(default_factory=dict)
    sizes: Mapping[str, Size] = field(default_factory=dict)
    picked_sizes: Mapping[str, Size] = field(default_factory=dict)

    def size_problem(self, camera: str) -> str:
        """Why the picks of a camera do not fit its picture; "" where they do."""
        now, then = self.sizes.get(camera), self.picked_sizes.get(camera)
        if now is None or then is None or now == then or not self.picks.get(camera):
            return ""
        return (
            f"{camera}: its picture has {now[0]} x {now[1]} px, its points were placed in {then[0]} x {then[1]}: a camera "
            "may show another part of the room then; clear its points, or set the camera to the earlier size"
        )


@dataclass(frozen=True)
class Solution:
    """views: by camera, in their order.  verdict: good, unchecked, poor; "" while a camera is not solved.

    cameras: that are solved.  report: lines, for people.  sentence: what to do next.
    """

    views: Sequence[PlacedView]
    verdict: str
    reasons: Sequence[str]
    cameras: Mapping[str, Camera]
    report: Sequence[str]
    sentence: str


class PointsTask(Protocol):
    """A way to calibrate from points in pictures.  editable, centre_lines: see `PointTaskUpdate`."""

    name: PointTask
    editable: bool
    centre_lines: bool

    def start(self) -> Placed:
        """What is known before the page is opened."""

    def completed(self, placed: Placed) -> Placed:
        """With the places of points that follow from the measured quantities."""

    def fields(self, placed: Placed) -> list[FieldRow]: ...

    def solve(self, placed: Placed) -> Solution:
        """Solve all cameras that can be solved."""

    def write(self, placed: Placed, solution: Solution) -> list[str]:
        """Write the files; returns their names.  Raises UserError with the reason where there is nothing to write."""


def refused(texts: Sequence[str]) -> UserError:
    """Error of a calibration that is not complete."""
    return UserError(f"not yet: {'; '.join(texts)}")


def next_sentence(verdict: str, reasons: Sequence[str]) -> str:
    """What to do after all points are placed."""
    return "Good: press Save." if verdict == "good" else f"{reasons[0]}." if reasons else "Press Save."
