"""Calibration of a rig from views of a board: lenses, poses, delays, world, expected error."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from zenocap.common.arrays import Bools, Floats
from zenocap.common.camera.lens import Lens, of_images
from zenocap.common.camera.pinhole import Camera
from zenocap.common.errors import UserError
from zenocap.tools.setup.calibration.april_grid import check_spacing
from zenocap.tools.setup.calibration.board import Board
from zenocap.tools.setup.calibration.board_views import CameraViews
from zenocap.tools.setup.calibration.bundle import Adjusted, Corners, RigState, adjusted, seen_corners
from zenocap.tools.setup.calibration.floor import World, at_floor, floor_world, guessed_world
from zenocap.tools.setup.calibration.frame_sets import chosen_frame_sets, frame_sets_near, shared_counts
from zenocap.tools.setup.calibration.lens_choice import first_lens, held_out_error, spread_views
from zenocap.tools.setup.calibration.lens_model import LensModel
from zenocap.tools.setup.calibration.parameters import CORNER_PX, FLOOR_S, LEAST_READOUT_S, LENS_VIEWS, SURE_READOUT
from zenocap.tools.setup.calibration.precision import claimed_error, focal_errors, readout_errors
from zenocap.tools.setup.calibration.rig_start import BoardFrameSet, board_poses, composed, inverse, start_poses

ROUNDS = 3  # of adjustment, after which delays changed by less than a millisecond on simulated films
OUTLIER = 6.0  # times the median error of a camera's views, from which a view is left out
MEDIAN_DISTANCE = 1.177  # median of the length of a vector with two normal components of deviation 1
FLOOR_FRAME_SETS = 3  # of each stretch with the board on the floor


@dataclass(frozen=True)
class CalibratedCamera:
    """A camera of the result.

    views: images with the board.  coverage: share of the image's cells, 0 to 1.  residual_px: root mean square.
    held_out_px: of the first lens, with views it was not fitted to.  delay_s: by which its images are later than their
    times.  focal_error: relative standard deviation of the focal length.  readout_s: from the first to the last row of an
    image, readout_error_s: its standard deviation; 0 where it is not known.
    """

    camera: Camera
    looks: int
    views: int
    coverage: float
    residual_px: float
    held_out_px: float
    delay_s: float
    lens: str
    given_lens: bool
    focal_error: float
    readout_s: float = 0.0
    readout_error_s: float = 0.0

    @property
    def rolling_shutter(self) -> bool:
        """Whether rows are certainly exposed one after the other."""
        return bool(abs(self.readout_s) > max(LEAST_READOUT_S, SURE_READOUT * self.readout_error_s))


@dataclass(frozen=True)
class BoardCalibration:
    """shared: number of moments at which both cameras of a pair saw the board.  error_m: claimed, where the board was seen.

    left_out: number of views that contradicted all others.
    """

    board: Board
    cameras: tuple[CalibratedCamera, ...]
    shared: Mapping[tuple[str, str], int]
    error_m: float
    world: World
    left_out: int
    still: bool


def calibrated_rig(
    board: Board,
    seen: Sequence[CameraViews],
    lenses: Mapping[str, Lens] | None = None,
    floor_s: Sequence[float] = (),
    delays: bool = True,
    on_progress: Callable[[str], None] = lambda _: None,
) -> BoardCalibration:
    """Calibrate the cameras.  lenses: given ones by camera, which stay.  floor_s: when the board lay on the floor.

    delays: whether to estimate them; else images have the times of their files.  Raises UserError.
    """
    check_spacing(board, [view for one in seen for view in one.views])
    corners, names = board.corners, [one.name for one in seen]
    none = np.zeros(len(seen))  # delays and readouts
    frame_sets = _frame_sets(seen, none, floor_s)
    for time_s in floor_s:  # before the work
        at_floor(frame_sets, time_s)
    models, held_out = [], []
    for one in seen:
        on_progress(f"lens of {one.name}")
        if lenses is not None:
            models.append(_given(one, lenses))
            held_out.append(held_out_error(models[-1], spread_views(one, LENS_VIEWS), corners))
        else:
            model, error = first_lens(one, corners)
            models.append(model)
            held_out.append(error)
    own_delay = np.array([delays and not one.still for one in seen])
    own_lens = np.array([lenses is None] * len(seen))
    on_progress("poses of the cameras")
    poses, boards = start_poses(names, models, frame_sets, corners)
    start = RigState(tuple(models), tuple(poses), none, tuple(b for b in boards if b is not None), none)
    frame_sets = [frame_set for frame_set, b in zip(frame_sets, boards, strict=True) if b is not None]
    result, frame_sets, left_out, observed = _rounds(
        board, seen, start, frame_sets, own_lens, own_delay, floor_s, on_progress
    )
    on_progress("rolling shutter")
    rolled = adjusted(result.state, observed, own_lens, own_delay, np.array([not one.still for one in seen]))
    state = result.state
    if floor_s:
        world = floor_world(board, frame_sets, state.boards, floor_s)
    else:
        world = guessed_world(board, state.cameras, state.boards)
    shared_points = [
        corners @ b[0].T + b[1] for frame_set, b in zip(frame_sets, state.boards, strict=True) if len(frame_set.views) > 1
    ]
    points = np.concatenate(shared_points) if shared_points else np.zeros((0, 3))
    cameras = _cameras(seen, result, rolled, observed, world, held_out, lenses is not None)
    counts = shared_counts(seen, state.delays)
    shared = {(names[one], names[other]): count for (one, other), count in counts.items()}
    error = claimed_error(result, points) if len(points) else float("nan")
    return BoardCalibration(board, cameras, shared, error, world, left_out, all(o.still for o in seen))


def _cameras(
    seen: Sequence[CameraViews], result: Adjusted, rolled: Adjusted, observed: Corners, world: World,
    held_out: Sequence[float], given_lenses: bool,
) -> tuple[CalibratedCamera, ...]:  # fmt: skip
    """Cameras of the result in the world.  rolled: adjusted with rolling shutters."""
    state, focal, errors_s = result.state, focal_errors(result), readout_errors(rolled)
    guessed: tuple[str, ...] = () if world.known else ("vertical",)
    cameras = []
    for c, one in enumerate(seen):
        rotation, shift = composed(state.cameras[c], inverse(world.pose))
        camera = state.lenses[c].camera(one.name, rotation, shift)
        camera = replace(camera, guessed=(*camera.guessed, *guessed))
        residuals = result.residuals[observed.cameras == c]
        cameras.append(
            CalibratedCamera(
                camera, one.looks, len(one.views), one.coverage,
                float(np.sqrt((residuals**2).sum(axis=1).mean())), held_out[c], float(state.delays[c]),
                state.lenses[c].title, given_lenses, focal[c], float(rolled.state.readouts[c]), float(errors_s[c]),
            )
        )  # fmt: skip
    return tuple(cameras)


def _given(seen: CameraViews, lenses: Mapping[str, Lens]) -> LensModel:
    lens = next(iter(lenses.values())) if len(lenses) == 1 else lenses.get(seen.name)
    if lens is None:
        raise UserError(
            f"no lens of {seen.name}; there are: {', '.join(lenses)}; allowed: one for all, or one for each camera"
        )
    lens = of_images(lens, seen.size)
    if lens.size != seen.size:
        width, height = seen.size
        raise UserError(
            f"{seen.name}: images of {width} x {height} px, its lens is of {lens.size[0]} x {lens.size[1]}: "
            "allowed: equal sizes"
        )
    return LensModel.of(lens)


def _frame_sets(seen: Sequence[CameraViews], delays: Floats, floor_s: Sequence[float]) -> list[BoardFrameSet]:
    """Chosen frame sets, with some of each stretch on the floor."""
    chosen = chosen_frame_sets(seen, delays)
    for time_s in floor_s:
        chosen += frame_sets_near(seen, delays, time_s, FLOOR_S, FLOOR_FRAME_SETS)
    return sorted(chosen, key=lambda frame_set: frame_set.time_s)


def _rounds(
    board: Board,
    seen: Sequence[CameraViews],
    state: RigState,
    frame_sets: list[BoardFrameSet],
    own_lens: Bools,
    own_delay: Bools,
    floor_s: Sequence[float],
    on_progress: Callable[[str], None],
) -> tuple[Adjusted, list[BoardFrameSet], int, Corners]:
    """Adjust, find the noise of each camera, leave out wrong views, pair images by the delays found, and again."""
    noise, left_out = np.full(len(seen), 1.0), 0
    wrong: set[int] = set()
    for turn in range(ROUNDS):
        on_progress(f"adjustment {turn + 1} of {ROUNDS}, {len(frame_sets)} moments")
        observed = seen_corners(frame_sets, board.corners, noise)
        result = adjusted(state, observed, own_lens, own_delay, np.zeros(len(seen), dtype=np.bool_))
        if turn == ROUNDS - 1:
            break
        noise = _noise(result, observed, len(seen))
        wrong |= _wrong_views(result, observed, frame_sets)
        left_out = len(wrong)
        kept = [replace(one, views=tuple(v for v in one.views if id(v) not in wrong)) for one in seen]
        frame_sets = _frame_sets(kept, result.state.delays, floor_s)
        boards = board_poses(result.state.lenses, result.state.cameras, frame_sets, board.corners)
        good = [k for k, b in enumerate(boards) if b is not None]
        frame_sets = [frame_sets[k] for k in good]
        state = replace(result.state, boards=tuple(b for b in boards if b is not None))
    return result, frame_sets, left_out, observed


def _noise(result: Adjusted, observed: Corners, cameras: int) -> Floats:
    """Standard deviation of the corners of each camera, px, from the median error, which wrong corners do not move."""
    found = np.full(cameras, CORNER_PX)
    for c in range(cameras):
        rows = observed.cameras == c
        if rows.any():
            found[c] = max(CORNER_PX, float(np.median(np.hypot(*result.residuals[rows].T))) / MEDIAN_DISTANCE)
    return found


def _wrong_views(result: Adjusted, observed: Corners, frame_sets: Sequence[BoardFrameSet]) -> set[int]:
    """Views whose error is many times the usual one of their camera, relative to what their motion allows."""
    errors = np.hypot(*result.residuals.T) / observed.sigma
    by_view = [float(np.median(errors[a:b])) for a, b in zip(observed.starts[:-1], observed.starts[1:], strict=True)]
    cameras = observed.cameras[observed.starts[:-1]]
    wrong = set()
    for begin, camera, error in zip(observed.starts[:-1], cameras, by_view, strict=True):
        usual = float(np.median([one for one, c in zip(by_view, cameras, strict=True) if c == camera]))
        if error > OUTLIER * usual and error > OUTLIER / 2:
            wrong.add(id(frame_sets[observed.frame_sets[begin]].views[int(camera)]))
    return wrong
