"""True errors of takes and their stretches, and what of a take a kind of evidence has."""

from dataclasses import dataclass

import numpy as np

from benchmarks.cases.verdict.takes import FPS, FaultyTake
from zenocap.common import messages as m
from zenocap.common.arrays import Bools, Floats
from zenocap.common.body.kinematics import joint_centres
from zenocap.tools.judge.evidence import TakeEvidence, body_of
from zenocap.tools.judge.parameters import GOOD_ERROR_M, GOOD_LOST, LOST_ERROR_M, START_NS, UNUSABLE_ERROR_M, UNUSABLE_LOST
from zenocap.tools.parameters import EPOCH_NS

LOST_M = 0.25  # as in `zenocap evaluate`
CLASSES: tuple[m.Rating, ...] = ("good", "doubtful", "unusable")


@dataclass(frozen=True)
class TrueError:
    """errors: (frames, joints) m, NaN without a pose."""

    errors: Floats

    @property
    def mean(self) -> float:
        """Mean error of the joints of frames with a pose, m; NaN without any."""
        known = self.errors[np.isfinite(self.errors)]
        return float(known.mean()) if len(known) else float("nan")

    @property
    def lost(self) -> float:
        """Share of the joints without estimate or more than LOST_M off."""
        return float(np.mean(~(self.errors <= LOST_M)))

    @property
    def frames(self) -> Floats:
        """(frames,) mean error, at most LOST_ERROR_M, which is that of a frame without a pose."""
        found: Floats = np.nan_to_num(np.minimum(self.errors, LOST_ERROR_M), nan=LOST_ERROR_M).mean(axis=1)
        return found

    @property
    def rating(self) -> m.Rating:
        return true_rating(self.mean, self.lost)


def true_rating(mean_m: float, lost: float) -> m.Rating:
    """Class of a take by the mean error of its joints and the share of lost ones."""
    if not np.isfinite(mean_m) or mean_m > UNUSABLE_ERROR_M or lost > UNUSABLE_LOST:
        return "unusable"
    return "good" if mean_m <= GOOD_ERROR_M and lost <= GOOD_LOST else "doubtful"


def true_error(take: FaultyTake, evidence: TakeEvidence) -> TrueError:
    """Errors of the poses against the truth, in the scored frames."""
    rows = scored(take)
    return TrueError(np.linalg.norm(found_joints(take, evidence)[rows] - take.points[rows], axis=2))


def scored(take: FaultyTake) -> Bools:
    """(frames,) whether a frame counts: the first START_NS in view do not, as for the verdict."""
    seen = (one.captured_ns for one in take.messages if isinstance(one, m.Silhouette) and one.data)
    since_ns = min(seen, default=EPOCH_NS) + START_NS - EPOCH_NS
    rows: Bools = take.frames >= since_ns / 1e9 * FPS - 0.5
    return rows


def found_joints(take: FaultyTake, evidence: TakeEvidence) -> Floats:
    """(frames, joints, 3) joint centres of the poses in the frames of the truth, metres; NaN without a pose."""
    found = np.full(take.points.shape, np.nan)
    if (body := body_of(evidence)) is not None:
        markers = [marker.name for marker in body.anatomy.markers]
        columns, rows = [markers.index(name) for name in take.names], {row.frame: row for row in evidence.poses.values()}
        for k, frame in enumerate(take.frames.tolist()):
            if (row := rows.get(frame)) is not None and not row.lost:
                found[k] = joint_centres(body.anatomy, body.bdp, body.pose(row))[columns]
    return found
