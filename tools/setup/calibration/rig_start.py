"""Start of the bundle adjustment: camera poses from board poses in shared views."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.errors import UserError
from zenocap.tools.setup.calibration.board_views import View
from zenocap.tools.setup.calibration.lens_model import LensModel, plane_poses

Pose = tuple[Floats, Floats]
"""Rotation (3, 3) and translation (3,) m."""

Proposals = Sequence[tuple[Floats, Floats, float]]
"""Poses of the board, board to camera, and their errors in px, see `plane_poses`."""

MAX_TRIED = 40  # shared views of a pair that propose its relative pose
MAX_CHECKED = 60  # and on which proposals are judged


@dataclass(frozen=True)
class BoardFrameSet:
    """A moment at which cameras, by number, saw the board.  time_s: common to all cameras."""

    time_s: float
    views: Mapping[int, View]


def relative_pose(first: Pose, second: Pose) -> Pose:
    """Camera `first` to camera `second`, from the poses of one board, board to camera."""
    rotation = second[0] @ first[0].T
    return rotation, second[1] - rotation @ first[1]


def composed(outer: Pose, inner: Pose) -> Pose:
    """outer after inner."""
    return outer[0] @ inner[0], outer[0] @ inner[1] + outer[1]


def inverse(pose: Pose) -> Pose:
    return pose[0].T, -pose[0].T @ pose[1]


def start_poses(
    names: Sequence[str], lenses: Sequence[LensModel], frame_sets: Sequence[BoardFrameSet], corners: Floats
) -> tuple[list[Pose], list[Pose | None]]:
    """Poses of the cameras, world to camera, and of the board at each frame set, board to world; None where none fits.

    The world is the frame of the first camera.  Raises UserError, which names cameras without a shared view.
    """
    seen = [_proposals(lenses, frame_set, corners) for frame_set in frame_sets]
    pairs: dict[tuple[int, int], tuple[Pose, float, int]] = {}
    for one, other in combinations(range(len(names)), 2):
        shared = [k for k, poses in enumerate(seen) if poses.get(one) and poses.get(other)]
        if shared:
            pairs[one, other] = (*_consensus(one, other, shared, seen, lenses, frame_sets, corners), len(shared))
    cameras: dict[int, Pose] = {0: (np.eye(3), np.zeros(3))}
    while len(cameras) < len(names):
        edges = [pair for pair in pairs if (pair[0] in cameras) != (pair[1] in cameras)]
        if not edges:
            inside = ", ".join(names[c] for c in sorted(cameras))
            outside = ", ".join(name for c, name in enumerate(names) if c not in cameras)
            raise UserError(
                f"{outside}: no view of the board at the same time as in {inside}: hold the board where a camera of each "
                "group sees it at once, tilted between them; for videos that began at different times: zenocap sync"
            )
        pair = min(edges, key=lambda edge: pairs[edge][1] / np.sqrt(pairs[edge][2]))
        one, other = pair
        pose = pairs[pair][0]
        if one in cameras:
            cameras[other] = composed(pose, cameras[one])
        else:
            cameras[one] = composed(inverse(pose), cameras[other])
    ordered = [cameras[c] for c in range(len(names))]
    return ordered, board_poses(lenses, ordered, frame_sets, corners)


def board_poses(
    lenses: Sequence[LensModel], cameras: Sequence[Pose], frame_sets: Sequence[BoardFrameSet], corners: Floats
) -> list[Pose | None]:
    """Poses of the board at the frame sets, board to world, in which the cameras agree best; None where none fits."""
    return [_board(one, _proposals(lenses, one, corners), cameras, lenses, corners) for one in frame_sets]


def _proposals(lenses: Sequence[LensModel], frame_set: BoardFrameSet, corners: Floats) -> dict[int, Proposals]:
    """By camera."""
    return {c: plane_poses(lenses[c], corners[view.ids], view.pixels) for c, view in frame_set.views.items()}


def _consensus(
    one: int,
    other: int,
    shared: Sequence[int],
    seen: Sequence[Mapping[int, Proposals]],
    lenses: Sequence[LensModel],
    frame_sets: Sequence[BoardFrameSet],
    corners: Floats,
) -> tuple[Pose, float]:
    """Relative pose of a pair that explains the most of its shared views, and its median error, px."""
    checked, lens = shared[:: max(1, len(shared) // MAX_CHECKED)], lenses[other]
    best: tuple[float, Pose] | None = None
    for k in shared[:: max(1, len(shared) // MAX_TRIED)]:
        for first in seen[k][one]:
            for second in seen[k][other]:
                pose = relative_pose(first[:2], second[:2])
                errors = (_transfer(pose, seen[j][one], lens, frame_sets[j].views[other], corners) for j in checked)
                error = _median_below(np.inf if best is None else best[0], errors, len(checked))
                if best is None or error < best[0]:
                    best = (error, pose)
    assert best is not None
    return best[1], best[0]


def _median_below(limit: float, errors: Iterable[float], count: int) -> float:
    """Median of `count` errors; infinity as soon as more than half of them say that it is not below the limit."""
    taken: list[float] = []
    above = 0
    for error in errors:
        taken.append(error)
        above += error >= limit
        if above > count // 2:
            return np.inf
    return float(np.median(taken))


def _transfer(pose: Pose, firsts: Proposals, lens: LensModel, view: View, corners: Floats) -> float:
    """Error in the second camera of the board as the first one sees it, of its two poses the better, px."""
    errors = []
    for first in firsts:
        rotation, shift = composed(pose, first[:2])
        local = corners[view.ids] @ rotation.T + shift
        if local[:, 2].min() > 0:
            errors.append(float(np.sqrt(((lens.project(local)[0] - view.pixels) ** 2).sum(axis=1).mean())))
    return min(errors, default=1e6)


def _board(
    frame_set: BoardFrameSet,
    poses: Mapping[int, Proposals],
    cameras: Sequence[Pose],
    lenses: Sequence[LensModel],
    corners: Floats,
) -> Pose | None:
    """The pose of the board, of those that any camera proposes, that all cameras agree to best."""
    best: tuple[float, Pose] | None = None
    for c, proposals in poses.items():
        for proposal in proposals:
            pose = composed(inverse(cameras[c]), proposal[:2])
            error = max(
                _transfer(cameras[d], [(*pose, 0.0)], lenses[d], view, corners) for d, view in frame_set.views.items()
            )
            if best is None or error < best[0]:
                best = (error, pose)
    return None if best is None else best[1]
