"""First lenses of the cameras; held-out views choose the number of coefficients."""

from collections.abc import Sequence

import cv2
import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.camera.fisheye import FisheyeLens
from zenocap.common.errors import UserError
from zenocap.tools.setup.calibration.board_views import CameraViews, View
from zenocap.tools.setup.calibration.frame_sets import distinct_views
from zenocap.tools.setup.calibration.lens_model import LensModel, plane_poses
from zenocap.tools.setup.calibration.parameters import FISHEYE_GAIN, HELD_OUT_GAIN, LENS_VIEWS, SLOW_PX_S

FLAGS = {4: cv2.CALIB_FIX_K3, 5: 0, 8: cv2.CALIB_RATIONAL_MODEL}
# OpenCV 5 has the flags of its fisheye model among the others.  The high orders are determined by few views.
FISHEYE_FLAG_NAMES = (
    "CALIB_USE_INTRINSIC_GUESS", "CALIB_RECOMPUTE_EXTRINSIC", "CALIB_FIX_SKEW", "CALIB_FIX_K3", "CALIB_FIX_K4",
)  # fmt: skip
FISHEYE_FLAGS = sum(int(getattr(cv2.fisheye, name, None) or getattr(cv2, name)) for name in FISHEYE_FLAG_NAMES)
MIN_VIEWS = 4  # three fix the focal length and the principal point; one is to spare
WHOLE_SHARES = (1.0, 0.8, 0.6)  # of the views, those with the most corners, to which a fisheye lens is fitted
HELD_OUT_VIEWS = 10  # from which several lenses are compared


def spread_views(seen: CameraViews, count: int) -> list[View]:
    """Up to `count` views that cover the image evenly, slow ones first."""
    views = distinct_views(seen.views)
    features = np.array([view.cells(seen.size) for view in views], dtype=np.float64)
    slowness = np.array([1.0 / (1.0 + np.nan_to_num(view.speed, nan=SLOW_PX_S) / SLOW_PX_S) for view in views])
    chosen: list[int] = []
    while len(chosen) < min(count, len(views)):
        gains = features @ (1.0 / (1.0 + features[chosen].sum(axis=0))) * slowness
        gains[chosen] = -1.0
        chosen.append(int(gains.argmax()))
    return [views[k] for k in sorted(chosen)]


def first_lens(seen: CameraViews, corners: Floats) -> tuple[LensModel, float]:
    """The lens of a camera and its held-out error, px.  corners: (n, 3) of the board, m.  Raises UserError."""
    views = spread_views(seen, LENS_VIEWS)
    if len(views) < MIN_VIEWS:
        raise UserError(
            f"{seen.name}: the board is found in {len(seen.views)} images, {len(views)} of them of different places: "
            f"allowed: {MIN_VIEWS} or more; show it longer, and move it"
        )
    if len(views) < HELD_OUT_VIEWS:
        if (only := _fitted(seen.size, views, corners, 4)) is None:
            raise UserError(f"{seen.name}: {NO_LENS}")
        return only, held_out_error(only, views, corners)
    fitted, held = views[::2], views[1::2]
    best: tuple[float, int] | None = None
    for count, gain in ((4, 0.0), (5, HELD_OUT_GAIN), (8, HELD_OUT_GAIN), (0, FISHEYE_GAIN)):
        lens = _fitted(seen.size, fitted, corners, count)
        if lens is not None:
            error = held_out_error(lens, held, corners)
            if np.isfinite(error) and (best is None or error < best[0] * (1.0 - gain)):
                best = (error, count)
    final = None if best is None else _fitted(seen.size, views, corners, best[1])
    if best is None or final is None:
        raise UserError(f"{seen.name}: {NO_LENS}")
    return final, best[0]


NO_LENS = "no lens fits the views of the board: show it nearer, tilted to all sides, and in all parts of the image"


def held_out_error(lens: LensModel, views: Sequence[View], corners: Floats) -> float:
    """Median error (rms, px) of views in which only the pose of the board is fitted; infinity where half have none."""
    errors = []
    for view in views:
        poses = plane_poses(lens, corners[view.ids], view.pixels)
        errors.append(poses[0][2] if poses else float("inf"))
    return float(np.median(errors))


def _fitted(size: tuple[int, int], views: Sequence[View], corners: Floats, count: int) -> LensModel | None:
    """The lens with `count` coefficients, 0 for a fisheye lens; None where OpenCV finds none that is plausible."""
    if count:
        return _fitted_to(size, views, corners, count)
    # OpenCV's start of the poses fails for some views with few corners at the edge; without them the lens is found.
    whole = sorted(views, key=lambda view: -len(view.ids))
    tries = (whole[: max(MIN_VIEWS, round(share * len(views)))] for share in WHOLE_SHARES)
    found = [lens for part in tries if (lens := _fitted_to(size, part, corners, 0)) is not None]
    return min(found, key=lambda lens: held_out_error(lens, views, corners), default=None)


def _fitted_to(size: tuple[int, int], views: Sequence[View], corners: Floats, count: int) -> LensModel | None:
    objects = [corners[view.ids].astype(np.float32) for view in views]
    pixels = [view.pixels.astype(np.float32) for view in views]
    try:
        if count:
            _, matrix, distortions, _, _ = cv2.calibrateCamera(objects, pixels, size, None, None, flags=FLAGS[count])
        else:
            shaped = [one[None].astype(np.float64) for one in objects]
            seen = [one[None].astype(np.float64) for one in pixels]
            start = np.array([[size[0] / 2.0, 0.0, size[0] / 2.0], [0.0, size[0] / 2.0, size[1] / 2.0], [0.0, 0.0, 1.0]])
            _, matrix, distortions, _, _ = cv2.fisheye.calibrate(
                shaped, seen, size, start, np.zeros(4), flags=FISHEYE_FLAGS
            )
    except cv2.error:
        return None
    coefficients = np.asarray(distortions, dtype=np.float64).ravel()[: count or 4]
    values = np.concatenate([matrix[[0, 1], [0, 1]], matrix[:2, 2], coefficients])
    plausible = np.isfinite(values).all() and 0.1 * size[0] < values[0] < 20 * size[0]
    centred = all(0 < values[2 + axis] < size[axis] for axis in (0, 1))
    lens = LensModel(size, values, count == 0)
    if lens.fisheye and not FisheyeLens(size, lens.matrix, lens.distortions).increases:
        return None
    return lens if plausible and centred else None
