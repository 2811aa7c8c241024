"""Bundle adjustment of lenses, poses, delays and board poses.

Residual of corner j of the board at frame set m in camera c, px (T: board to world, then world to camera c):

    r = π_c(T_c T_m X_j) - (x_j + v_j (t_m - t_cm - d_c - q_c u_j))

x_j: where the corner was seen at the time t_cm of the camera's image; v_j: its velocity; d_c: delay of the camera; q_c:
time from the first to the last row of its image (rolling shutter), u_j: row of the corner, from -1/2 at the top to 1/2.
Levenberg-Marquardt on the normal equations, soft-L1 loss; the poses of the board are eliminated (Schur complement).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from zenocap.common.arrays import Bools, Floats, Ints
from zenocap.tools.setup.calibration.lens_model import LensModel
from zenocap.tools.setup.calibration.parameters import ROBUST, SKEW_S
from zenocap.tools.setup.calibration.rig_start import BoardFrameSet, Pose

POSE, DELAY, LENS = 6, 1, 12  # parameters of a camera: pose, delay, lens with up to eight coefficients
READOUT = POSE + DELAY + LENS  # the last one: time of readout
WIDTH = READOUT + 1
MAX_STEPS, CONVERGED = 40, 1e-6  # of the cost, relative
PRIOR_DELAY_S = 0.5
PRIOR_READOUT_S = 0.1
PRIOR_COEFFICIENT = 1.0  # weak: keeps coefficients that the views do not show near their start
PRIOR_FISHEYE = 0.02  # of k3 and k4 of fisheye lenses, which only the border of the image shows


@dataclass(frozen=True)
class Corners:
    """Seen corners, view by view: (n,) camera and frame set, (n, 3) m on the board, (n, 2) px and px/s, (n,) s, (n,) px.

    ahead_s: time of the frame set less that of the image.  sigma: standard deviation.  starts: of the views, (views + 1,).
    """

    cameras: Ints
    frame_sets: Ints
    points: Floats
    pixels: Floats
    velocities: Floats
    ahead_s: Floats
    sigma: Floats
    starts: Ints


@dataclass(frozen=True)
class RigState:
    """Unknowns of the adjustment.  cameras: world to camera.  boards: board to world.  delays, readouts: (cameras,) s."""

    lenses: tuple[LensModel, ...]
    cameras: tuple[Pose, ...]
    delays: Floats
    boards: tuple[Pose, ...]
    readouts: Floats


@dataclass(frozen=True)
class Adjusted:
    """Result.  residuals: (n, 2) px.  free: of the 20 parameters of each camera.

    covariances: of the free ones, for independent errors of the corners, and for errors that a view's corners share.
    """

    state: RigState
    residuals: Floats
    free: Bools
    covariances: tuple[Floats, ...]


def seen_corners(frame_sets: Sequence[BoardFrameSet], corners: Floats, noise_px: Floats) -> Corners:
    """Corners of all views of the frame sets.  corners: (n, 3) of the board.  noise_px: (cameras,)."""
    rows = [(c, m, view) for m, frame_set in enumerate(frame_sets) for c, view in sorted(frame_set.views.items())]
    counts = [len(view.ids) for _, _, view in rows]
    speeds = [np.hypot(*view.velocities.T) for _, _, view in rows]
    sigma = [np.sqrt(noise_px[c] ** 2 + (SKEW_S * speed) ** 2) for (c, _, _), speed in zip(rows, speeds, strict=True)]
    return Corners(
        np.repeat([c for c, _, _ in rows], counts),
        np.repeat([m for _, m, _ in rows], counts),
        np.concatenate([corners[view.ids] for _, _, view in rows]),
        np.concatenate([view.pixels for _, _, view in rows]),
        np.concatenate([view.velocities for _, _, view in rows]),
        np.repeat([frame_sets[m].time_s - view.time_s for _, m, view in rows], counts),
        np.concatenate(sigma),
        np.concatenate([[0], np.cumsum(counts)]),
    )


def adjusted(state: RigState, seen: Corners, own_lens: Bools, own_delay: Bools, own_readout: Bools) -> Adjusted:
    """The state that fits the corners best.  own_lens, own_delay, own_readout: (cameras,) whether these are estimated.

    The first camera defines the world and the time: its pose and its delay stay.
    """
    free = np.zeros((len(state.cameras), WIDTH), dtype=np.bool_)
    free[1:, :POSE] = True
    free[1:, POSE] = own_delay[1:]
    free[:, READOUT] = own_readout
    for c, lens in enumerate(state.lenses):
        free[c, POSE + DELAY : POSE + DELAY + len(lens.values)] = own_lens[c]
    prior = _prior(state)
    start, damping = state, 1e-3
    cost = _cost(state, seen, _residuals(state, seen), prior, start)
    for _ in range(MAX_STEPS):
        system = _System(state, seen, free, prior, start)
        improved = False
        for _ in range(8):
            candidate = system.step(damping)
            new = _cost(candidate, seen, _residuals(candidate, seen), prior, start)
            if new < cost:
                improved = cost - new > CONVERGED * cost
                state, cost, damping = candidate, new, max(damping / 5.0, 1e-9)
                break
            damping *= 5.0
        if not improved:
            break
    residuals = _residuals(state, seen)
    return Adjusted(state, residuals, free, _System(state, seen, free, prior, start).covariances(residuals))


def _prior(state: RigState) -> Floats:
    """Information of what is known without any view, (cameras, 20)."""
    found = np.zeros((len(state.cameras), WIDTH))
    found[:, POSE] = PRIOR_DELAY_S**-2
    found[:, READOUT] = PRIOR_READOUT_S**-2
    found[:, POSE + DELAY + 4 : READOUT] = PRIOR_COEFFICIENT**-2
    for c, lens in enumerate(state.lenses):
        if lens.fisheye:
            found[c, POSE + DELAY + 6 : READOUT] = PRIOR_FISHEYE**-2
    return found


def _values(state: RigState) -> Floats:
    """Delay, readout and lens of each camera, (cameras, 20); zeros for the pose."""
    found = np.zeros((len(state.cameras), WIDTH))
    found[:, POSE], found[:, READOUT] = state.delays, state.readouts
    for c, lens in enumerate(state.lenses):
        found[c, POSE + DELAY : POSE + DELAY + len(lens.values)] = lens.values
    return found


def _drift(state: RigState, start: RigState) -> Floats:
    """Change since the start; of delay and readout, these themselves."""
    drift = _values(state) - _values(start)
    drift[:, POSE], drift[:, READOUT] = state.delays, state.readouts
    return drift


def _rows(state: RigState, seen: Corners) -> Floats:
    """Rows of the corners, (n,): -1/2 at the top of the image, 1/2 at the bottom."""
    heights = np.array([lens.size[1] for lens in state.lenses])[seen.cameras]
    return np.asarray((seen.pixels[:, 1] + 0.5) / heights - 0.5)


def _measured(state: RigState, seen: Corners) -> Floats:
    shift = seen.ahead_s - state.delays[seen.cameras] - state.readouts[seen.cameras] * _rows(state, seen)
    return np.asarray(seen.pixels + seen.velocities * shift[:, None])


def _local(state: RigState, seen: Corners) -> tuple[Floats, Floats, Floats]:
    """Corners turned as the board, in the world, and in the cameras' frames, each (n, 3)."""
    boards, cameras = np.array([b[0] for b in state.boards]), np.array([c[0] for c in state.cameras])
    shifts, places = np.array([b[1] for b in state.boards]), np.array([c[1] for c in state.cameras])
    turned = np.einsum("nij,nj->ni", boards[seen.frame_sets], seen.points)
    world = turned + shifts[seen.frame_sets]
    local = np.einsum("nij,nj->ni", cameras[seen.cameras], world) + places[seen.cameras]
    return turned, world, local


def _residuals(state: RigState, seen: Corners) -> Floats:
    _, _, local = _local(state, seen)
    predicted = np.zeros_like(seen.pixels)
    for c, lens in enumerate(state.lenses):
        rows = seen.cameras == c
        if rows.any():
            predicted[rows] = lens.project(local[rows])[0]
    residuals: Floats = predicted - _measured(state, seen)
    residuals[local[:, 2] <= 0] = 1e6
    return residuals


def _robust(residuals: Floats, seen: Corners) -> Floats:
    """Squared errors relative to the loss' scale, (n,)."""
    return np.asarray((residuals**2).sum(axis=1) / (ROBUST * seen.sigma) ** 2)


def _cost(state: RigState, seen: Corners, residuals: Floats, prior: Floats, start: RigState) -> float:
    loss = 2.0 * ROBUST**2 * (np.sqrt(1.0 + _robust(residuals, seen)) - 1.0)
    return float(loss.sum() + (prior * _drift(state, start) ** 2).sum())


def _cross(vectors: Floats) -> Floats:
    """Matrices (n, 3, 3) of the cross product with vectors (n, 3)."""
    x, y, z = vectors.T
    o = np.zeros_like(x)
    return np.stack([o, -z, y, z, o, -x, -y, x, o], axis=-1).reshape(-1, 3, 3)


class _System:
    """Normal equations at a state."""

    def __init__(self, state: RigState, seen: Corners, free: Bools, prior: Floats, start: RigState) -> None:
        self.state, self.seen, self.free = state, seen, free.ravel()
        turned, world, local = _local(state, seen)
        count, cameras, frame_sets = len(local), len(state.cameras), len(state.boards)
        by_camera, residuals = np.zeros((count, 2, WIDTH)), np.zeros((count, 2))
        by_point = np.zeros((count, 2, 3))
        for c, lens in enumerate(state.lenses):
            rows = seen.cameras == c
            if rows.any():
                residuals[rows], by_point[rows], slopes = lens.project(local[rows])
                by_camera[rows, :, POSE + DELAY : POSE + DELAY + slopes.shape[2]] = slopes
        residuals -= _measured(state, seen)
        rotations = np.array([c[0] for c in state.cameras])[seen.cameras]
        by_camera[:, :, :3] = -by_point @ _cross(np.einsum("nij,nj->ni", rotations, world))
        by_camera[:, :, 3:6] = by_point
        by_camera[:, :, POSE] = seen.velocities
        by_camera[:, :, READOUT] = seen.velocities * _rows(state, seen)[:, None]
        by_world = by_point @ rotations
        by_board = np.concatenate([-by_world @ _cross(turned), by_world], axis=2)
        weight = 1.0 / np.sqrt(1.0 + _robust(residuals, seen)) / seen.sigma**2
        root = np.sqrt(weight)[:, None]
        by_camera, by_board, residuals = by_camera * root[..., None], by_board * root[..., None], residuals * root
        self.cameras = np.zeros((cameras, WIDTH, WIDTH))
        self.boards = np.zeros((frame_sets, 6, 6))
        self.mixed = np.zeros((frame_sets, cameras, WIDTH, 6))
        self.views: list[tuple[int, int, Floats, Floats]] = []  # camera, frame set, and slopes of one view
        self.camera_slope, self.board_slope = np.zeros((cameras, WIDTH)), np.zeros((frame_sets, 6))
        for begin, end in zip(seen.starts[:-1], seen.starts[1:], strict=True):
            c, m = seen.cameras[begin], seen.frame_sets[begin]
            a, b = by_camera[begin:end].reshape(-1, WIDTH), by_board[begin:end].reshape(-1, 6)
            r = residuals[begin:end].ravel()
            self.cameras[c] += a.T @ a
            self.boards[m] += b.T @ b
            self.mixed[m, c] += a.T @ b
            self.camera_slope[c] += a.T @ r
            self.board_slope[m] += b.T @ r
            self.views.append((int(c), int(m), a.T @ r, b.T @ r))
        self.cameras[:, range(WIDTH), range(WIDTH)] += prior
        self.camera_slope += prior * _drift(state, start)

    def _reduced(self, damping: float) -> tuple[Floats, Floats, Floats]:
        """Matrix and slope of the free parameters of the cameras, and the inverses of the boards' blocks."""
        cameras, width = len(self.cameras), len(self.cameras) * WIDTH
        boards = self.boards * (1.0 + damping * np.eye(6)) + 1e-12 * np.eye(6)
        inverses = np.asarray(np.linalg.inv(boards), dtype=np.float64)
        mixed = self.mixed.reshape(len(boards), width, 6)
        matrix = np.zeros((width, width))
        for c in range(cameras):
            part = slice(c * WIDTH, (c + 1) * WIDTH)
            matrix[part, part] = self.cameras[c] * (1.0 + damping * np.eye(WIDTH))
        weighted = mixed @ inverses
        matrix -= np.tensordot(weighted, mixed, axes=([0, 2], [0, 2]))
        slope = self.camera_slope.ravel() - np.einsum("mwi,mi->w", weighted, self.board_slope)
        return matrix[np.ix_(self.free, self.free)], slope[self.free], inverses

    def step(self, damping: float) -> RigState:
        """The state after one damped step."""
        matrix, slope, inverses = self._reduced(damping)
        change = np.zeros(len(self.free))
        if len(slope):
            sizes = _scale(matrix)
            change[self.free] = -np.linalg.lstsq(matrix / np.outer(sizes, sizes), slope / sizes, rcond=1e-14)[0] / sizes
        mixed = self.mixed.reshape(len(inverses), -1, 6)
        boards = -np.einsum("mij,mj->mi", inverses, self.board_slope + np.einsum("mwi,w->mi", mixed, change))
        state, by_camera = self.state, change.reshape(-1, WIDTH)
        return replace(
            moved_cameras(state, by_camera),
            delays=state.delays + by_camera[:, POSE],
            boards=tuple(_turned(pose, one[:3], one[3:]) for pose, one in zip(state.boards, boards, strict=True)),
            readouts=state.readouts + by_camera[:, READOUT],
        )

    def covariances(self, residuals: Floats) -> tuple[Floats, ...]:
        """Covariances of the free parameters of the cameras: for independent errors, and for errors common to a view.

        The second is that of clustered errors (Liang and Zeger 1986), N⁻¹ (Σ g gᵀ) N⁻¹ with the slopes g of the views: a
        wrong time of an image moves all of its corners.
        """
        matrix, slope, inverses = self._reduced(0.0)
        if not len(slope):
            return (np.zeros((0, 0)),)
        sizes = _scale(matrix)
        inverse = np.linalg.pinv(matrix / np.outer(sizes, sizes), rcond=1e-14, hermitian=True) / np.outer(sizes, sizes)
        scale = max(1.0, float(np.median(_robust(residuals, self.seen)) * ROBUST**2 / 1.386))  # median of chi² with two
        unknowns = len(slope) + 6 * len(inverses)
        free = max(0.1, 1.0 - unknowns / (2.0 * len(residuals)))
        weighted = self.mixed.reshape(len(inverses), -1, 6) @ inverses
        slopes = []
        for c, m, camera, board in self.views:
            one = -weighted[m] @ board
            one[c * WIDTH : (c + 1) * WIDTH] += camera
            slopes.append(one[self.free])
        shared = np.array(slopes) @ inverse
        return inverse * scale / free, shared.T @ shared / free


def _scale(matrix: Floats) -> Floats:
    return np.asarray(np.sqrt(np.maximum(np.diag(matrix), 1e-12)))


def _turned(pose: Pose, turn: Floats, shift: Floats) -> Pose:
    """The pose turned by a rotation vector from the left."""
    rotation = np.asarray(cv2.Rodrigues(turn)[0], dtype=np.float64)
    return rotation @ pose[0], pose[1] + shift


def moved_cameras(state: RigState, by_camera: Floats) -> RigState:
    """The state with changes (cameras, 20) of the lenses and poses of the cameras; delays and readouts stay."""
    return replace(
        state,
        lenses=tuple(lens.moved(one[POSE + DELAY :]) for lens, one in zip(state.lenses, by_camera, strict=True)),
        cameras=tuple(_turned(pose, one[:3], one[3:6]) for pose, one in zip(state.cameras, by_camera, strict=True)),
    )
