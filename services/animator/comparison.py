"""Comparison of the played take with a second one: pose at the same time, joint distances."""

from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats, Ints
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.errors import UserError
from zenocap.common.formats.pose_track import PoseTrack
from zenocap.services.animator.page import page_messages as pm
from zenocap.services.animator.page.page_updates import body_update, pose_update
from zenocap.services.animator.parameters import MAX_UNMATCHED_NS
from zenocap.services.animator.states import ActorPose

DISTANCE_DIGITS = 4  # after the point, metres


@dataclass(frozen=True)
class TimedTrack:
    """Poses of a take.  captured_ns: (n,) rising capture times."""

    name: str
    captured_ns: Ints
    track: PoseTrack


class TakeComparison:
    """The shown take `one`, and the take `other`, whose poses are moved by `shift_ns` onto the times of `one`.

    alignment: how, for the user.
    """

    def __init__(self, one: TimedTrack, other: TimedTrack, offset_s: float = 0.0) -> None:
        """offset_s: delay of the other take.  Raises UserError for takes without a common joint."""
        self._one, self._other = one, other
        self._rows = {int(captured_ns): row for row, captured_ns in enumerate(one.captured_ns)}
        markers = [[marker.name for marker in track.anatomy.markers] for track in (one.track, other.track)]
        self._joints = [(name, markers[0].index(name), markers[1].index(name)) for name in markers[0] if name in markers[1]]
        if not self._joints:
            raise UserError(f"{other.name}: has no joint that {one.name} has: allowed: a take of a comparable body model")
        overlap = one.captured_ns[0] <= other.captured_ns[-1] and other.captured_ns[0] <= one.captured_ns[-1]
        base_ns = 0 if overlap else int(one.captured_ns[0] - other.captured_ns[0])
        self.shift_ns = base_ns + round(1e9 * offset_s)
        self.alignment = "aligned by recorded times" if overlap else "aligned at the first poses"
        if offset_s:
            self.alignment += f", shown {abs(offset_s):g} s {'later' if offset_s > 0 else 'earlier'}"
        intervals_ns = np.diff(other.captured_ns)
        typical_ns = int(np.median(intervals_ns)) if len(intervals_ns) else MAX_UNMATCHED_NS
        self._reach_ns = min(typical_ns, MAX_UNMATCHED_NS)

    def body(self) -> pm.GhostUpdate:
        """The second take and its body."""
        track = self._other.track
        return pm.GhostUpdate(self._other.name, self.alignment, body_update("ghost", track.anatomy, track.bdp))

    def at(self, actor: ActorPose, shift_ns: int) -> pm.GhostPoseUpdate | None:
        """The second take at the time of a pose of the shown one.

        shift_ns: delay of the actor's capture time against the recorded one.  None for a pose that was not recorded at that
        time: it is of another source, or the replay has just changed its shift.  The pose of the second take is the nearest
        in time, at most one of its intervals away.
        """
        row = self._rows.get(actor.captured_ns - shift_ns)
        if row is None:
            return None
        lost = "person" in actor.lost
        if not lost and not np.array_equal(actor.pose.angles, self._one.track.angles[row]):
            return None
        other_row = self._row_at(actor.captured_ns - shift_ns - self.shift_ns)
        if other_row is None:
            return pm.GhostPoseUpdate(None, {})
        track = self._other.track
        other = ActorPose(
            int(track.frames[other_row]), int(self._other.captured_ns[other_row]), actor.received_ns, actor.source,
            track.anatomy, track.bdp, track.pose(other_row), tuple(track.lost[other_row].split()),
        )  # fmt: skip
        return pm.GhostPoseUpdate(pose_update(other), {} if lost else self._distances(row, other_row))

    def _row_at(self, time_ns: int) -> int | None:
        """Row of the second take that is nearest to a time; None without a pose there."""
        times_ns = self._other.captured_ns
        after = int(np.searchsorted(times_ns, time_ns))
        row = min((k for k in (after - 1, after) if 0 <= k < len(times_ns)), key=lambda k: abs(int(times_ns[k]) - time_ns))
        far = abs(int(times_ns[row]) - time_ns) > self._reach_ns
        return None if far or not self._other.track.known[row] else row

    def _distances(self, row: int, other_row: int) -> dict[str, float]:
        """Distance of the centres of every common joint, metres: |p_one - p_other|, with the last body of each take.

        Exports have the last body too; the actor on the page has that of its time, which the tracker may still change.
        """
        tracks = (self._one.track, row), (self._other.track, other_row)
        centres: list[Floats] = [joint_centres(track.anatomy, track.bdp, track.pose(at)) for track, at in tracks]
        return {
            name: round(float(np.linalg.norm(centres[0][k] - centres[1][n])), DISTANCE_DIGITS)
            for name, k, n in self._joints
        }
