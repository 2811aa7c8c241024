"""Takes as numpy arrays: `open_take` and what it returns."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from heapq import heappop, heappush
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from zenocap.common.arrays import Floats, Ints
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp
from zenocap.common.body.joint_conventions import Convention
from zenocap.common.body.keypoints import Keypoints, keypoints
from zenocap.common.conversion import Bap, is_lost, pose_of
from zenocap.common.errors import UserError
from zenocap.common.formats.export_format import FORMATS, format_of
from zenocap.common.formats.pose_track import PoseTrack
from zenocap.common.formats.take_poses import TOPICS_USED, TakeSummary, limbs_of, summary_of
from zenocap.common.formats.trajectories import Axes, Unit
from zenocap.common.messages import BothWaysPose, TrackerPose, UniversalBap, Verdict
from zenocap.common.recording.reader import TakeReader
from zenocap.tools.takes.export import Exported, ExportOptions, export

CHUNK = 1000  # frames: 40 s at 25 frames/s, about 1 MB of arrays
REORDERED = 64  # poses that may be recorded out of the order of their capture times


@dataclass(frozen=True)
class Poses:
    """Poses of one person in n consecutive frames, in the world: metres, right-handed, Y up, origin on the ground.

    frames: (n,) frame numbers, rising.
    times_s: (n,) seconds since frame 0.
    captured_ns: (n,) capture times, nanoseconds since the Unix epoch.
    positions: (n, 3) of the navel, metres.
    angles: (n, angles) joint angles, radians, columns as `Take.angle_names`.
    joint_centres: (n, joints, 3) metres, columns as `joint_names`.
    lost: (n,) whether the person is being searched for; positions, angles and joint centres are NaN there.
    joint_names: (joints,) of the convention that was asked for; `Take.joint_names` for zenocap's own.
    limbs: by limb, such as `right_arm`: (n,) probability that elbow and wrist, or knee and ankle, are within 150 mm of the
    person's, NaN where unknown; empty with two-view.
    """

    frames: Ints
    times_s: Floats
    captured_ns: Ints
    positions: Floats
    angles: Floats
    joint_centres: Floats
    lost: NDArray[np.bool_]
    joint_names: tuple[str, ...]
    limbs: Mapping[str, Floats]

    def __len__(self) -> int:
        return len(self.frames)

    def __repr__(self) -> str:
        if not len(self):
            return "<Poses: none>"
        span = f"frames {self.frames[0]} to {self.frames[-1]}, {self.times_s[0]:.2f} to {self.times_s[-1]:.2f} s"
        return f"<Poses: {len(self)} of {len(self.joint_names)} joints, {span}, {np.count_nonzero(self.lost)} lost>"


@dataclass(frozen=True)
class Take:
    """A recorded take.  Only its summary is held in memory; `poses` and `chunks` read the file again.

    path: the MCAP file.  raw: poses of the forward pass, also of a take that was tracked both ways.
    rate: frames per second, 0 for a single frame.  frame_count: frames with a pose message.
    """

    path: Path
    _summary: TakeSummary
    raw: bool = False

    def __repr__(self) -> str:
        ways = ", both ways" if self.both_ways else ""
        damage = "" if self.missing is None else ", incomplete"
        return f"<Take {str(self.path)!r}: {self.frame_count} poses, {self.rate:.4g} frames/s{ways}{damage}>"

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of zenocap's own joint centres, as Pose2Sim has them: Hip, RHip, RKnee, ..."""
        return tuple(marker.name for marker in self._anatomy.markers)

    @property
    def angle_names(self) -> tuple[str, ...]:
        """Names of the joint angles, `joint.axis`, such as `right_knee.x`."""
        return self._anatomy.angles

    @property
    def frame_count(self) -> int:
        return len(self._summary.captured_ns)

    @property
    def rate(self) -> float:
        times_s = self._times_s
        frames = self._summary.frames
        return float(frames[-1] - frames[0]) / float(times_s[-1] - times_s[0]) if len(frames) > 1 else 0.0

    @property
    def both_ways(self) -> bool:
        """Whether the poses are those of both passes of `track`, and not of the forward pass."""
        return self._summary.kind is BothWaysPose

    @cached_property
    def verdict(self) -> Verdict:
        """Whether the poses can be used: `rating` is good, doubtful or unusable; with `reasons`, `stretches` and `text`.

        As recorded in the take, of the poses of both passes where there are any; computed where the take has none.
        """
        from zenocap.tools.judge.verdict import verdict_in

        return verdict_in(self.path)

    @property
    def missing(self) -> str | None:
        """Missing parts of a cut or damaged file, in words; None for a whole one."""
        return self._summary.cut

    def poses(self, *, joints: Convention = "zenocap", smooth: float | None = None, spine: bool = False) -> Poses:
        """Return all poses at once.  An hour at 30 frames/s takes about 150 MB.

        joints: convention of the joint centres: zenocap, isb, coco or halpe.
        smooth: cut-off frequency (Hz) of a Butterworth filter of order 4, forwards and backwards, which delays nothing;
        6 is usual for walking.  None: the poses as they are in the take.  Raises UserError for a frequency that the frame
        rate does not allow.
        spine: with the joints of the spine after those of the convention: Pelvis, Spine, Thorax, UpperNeck.
        """
        (poses,) = self.chunks(max(1, self.frame_count), joints=joints, spine=spine)
        return poses if smooth is None else self._smoothed(poses, smooth, joints, spine)

    def chunks(self, size: int = CHUNK, *, joints: Convention = "zenocap", spine: bool = False) -> Iterator[Poses]:
        """Yield the poses in order, at most `size` frames at a time.  joints, spine: see `poses`.

        Raises ValueError for a size below 1, and for an unknown convention.
        """
        if size < 1:
            raise ValueError(f"size = {size}: allowed: 1 or more frames")
        points = keypoints(joints, self._anatomy, self._bdp, spine=spine)
        rows: list[Bap] = []
        for bap in self._in_order():
            rows.append(bap)
            if len(rows) == size:
                yield self._arrays(rows, points)
                rows = []
        if rows:
            yield self._arrays(rows, points)

    def export(
        self,
        output: Path | str,
        *,
        fps: float | None = None,
        axes: Axes = "y-up",
        unit: Unit | None = None,
        joints: Convention = "zenocap",
        smooth: float | None = None,
        min_confidence: float = 0.0,
        spine: bool = False,
    ) -> Exported:
        """Write the poses to a file of another program, chosen by its suffix: .trc, .bvh, .c3d, .csv, .mot,
        .glb (.vrma) or .usd (.usda, .usdc, .usdz).

        fps: frames per second to resample to; None: the take's.  axes: of the file.  unit: of lengths; None: the
        format's usual one.  joints: convention of the points in .trc, .c3d and .csv; `Exported.left_out` names those that
        the body does not have.  smooth, spine: as in `poses`.  min_confidence: points of a limb that is less probable to be
        right are blank.  The file appears whole or not at all.  Raises UserError.
        """
        path = Path(output)
        form = format_of(path.suffix)
        if form is None:
            allowed = ", ".join(suffix for one in FORMATS.rows().values() for suffix in one.suffixes)
            raise UserError(f"{path}: suffix {path.suffix!r}: allowed: {allowed}")
        options = ExportOptions(
            form.name, fps=fps, axes=axes, unit=unit, joints=joints, smooth=smooth, raw=self.raw,
            min_confidence=min_confidence, spine=spine,
        )  # fmt: skip
        return export(self.path, path, options)

    @property
    def _anatomy(self) -> Anatomy:
        return self._summary.anatomy

    @cached_property
    def _bdp(self) -> Bdp:
        return self._summary.bdp

    @property
    def _times_s(self) -> Floats:
        return (self._summary.captured_ns - self._summary.start_ns) / 1e9

    def _in_order(self) -> Iterator[Bap]:
        """Pose messages by capture time, one each: the last recorded, as `zenocap.common.formats.take_poses` has them."""
        waiting: dict[int, Bap] = {}
        heap: list[int] = []
        newest_ns = self._summary.start_ns - 1  # of those given out
        for envelope in TakeReader(self.path).envelopes(TOPICS_USED):
            bap = envelope.message
            if not isinstance(bap, UniversalBap | TrackerPose) or type(bap) is not self._summary.kind:
                continue
            if bap.captured_ns <= newest_ns:
                continue
            if bap.captured_ns not in waiting:
                heappush(heap, bap.captured_ns)
            waiting[bap.captured_ns] = bap
            if len(heap) > REORDERED:
                newest_ns = heappop(heap)
                yield waiting.pop(newest_ns)
        while heap:
            yield waiting.pop(heappop(heap))

    def _arrays(self, rows: list[Bap], points: Keypoints) -> Poses:
        summary = self._summary
        at = np.searchsorted(summary.captured_ns, [bap.captured_ns for bap in rows])
        positions = np.full((len(rows), 3), np.nan)
        angles = np.full((len(rows), len(self.angle_names)), np.nan)
        centres = np.full((len(rows), len(points.names), 3), np.nan)
        lost = np.array([is_lost(bap) for bap in rows])
        for row in np.flatnonzero(~lost):
            pose = pose_of(self._anatomy, rows[row])
            positions[row], angles[row] = pose.position, pose.angles
            centres[row] = points.at(pose)
        times_s, captured_ns = self._times_s[at], summary.captured_ns[at]
        return Poses(
            summary.frames[at], times_s, captured_ns, positions, angles, centres, lost, points.names, limbs_of(rows)
        )

    def _smoothed(self, poses: Poses, hz: float, joints: Convention, spine: bool) -> Poses:
        from zenocap.common.formats.smoothing import smoothed

        lost = tuple("person" if one else "" for one in poses.lost)
        track = PoseTrack(
            self._anatomy, self._bdp, poses.frames, poses.times_s, poses.positions, poses.angles, {}, {}, lost, self.rate
        )
        track = smoothed(track, hz)
        centres = track.trajectories(joints, spine=spine).points
        return replace(poses, positions=track.positions, angles=track.angles, joint_centres=centres)


def open_take(path: Path | str, *, raw: bool = False) -> Take:
    """Open a take for reading: one written by `track`, by `zenocap track` or recorded from a running rig.

    The file is read once for its summary.  A cut or damaged file gives what is whole; `Take.missing` describes the rest.
    raw: the poses of the forward pass, also of a take that was tracked both ways.

    Raises UserError when the file cannot be read, is no take, or has no pose.
    """
    return Take(Path(path), summary_of(Path(path), raw=raw), raw)
