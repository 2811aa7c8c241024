"""Calibration of the paper: two level cameras and three upright objects.  [Two-view 4.1]

Cameras are aimed by line markers on the axes: camera 1 along -Z, camera 2 along +X, level, each axis on the
image's centre lines.  (The paper's lines 80/81 and 60/61 are 1-based: the centre is (79.5, 59.5) at 160 x 120.)  Equal
objects of height T stand on the ground at A = (0, 0, 0), B = (0, 0, D_Z) and C = (D_X, 0, 0).  With a camera at
distance d, height Y and focal length λ px, a pinnacle at depth δ is seen at

    column = c_x + λ · lateral / δ          row = c_y + λ (Y − T) / δ

For camera 1 (d = Z_c1) A and C are at depth d and B at d − D_Z.  For camera 2 (d = −X_c2) A and B are at depth d and C
at d + D_X.  With h = row − c_y, the apparent height of a pinnacle, the following is identifiable:

    d   from the apparent sizes:  h_along / h_A = d / (d + s)  ⇒  d = s · h_along / (h_A − h_along),
        s = −D_Z with B for camera 1, +D_X with C for camera 2; or measured with a tape, which is far more accurate
    λ   λ1 = Z_c1 (x1C − x1A) / D_X,   λ2 = −X_c2 (z2B − z2A) / D_Z       (the paper prints D_Z for both)
    Y   needs λ / d only:  Y = T + h_A · d / λ

The remaining three of the six coordinates are checks.  A and the object along the axis are on the centre column, and A
and the object beside it are on one row (roll).  Pinnacles at the camera's height (h = 0) do not determine the distance.
A wrong distance keeps λ / d: sizes at the centre are right, perspective is wrong.  A wrong column of A or of the object
beside it changes λ and Y and contradicts nothing, unless the camera's height is measured: see `line_sensitivity`.
"""

from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.camera.pinhole import Camera
from zenocap.common.errors import UserError

Pixel = tuple[float, float]

# All values below are chosen by hand.
PIXEL_NOISE = 0.5  # px, standard deviation of a marker's position
MAX_RESIDUAL = 0.01  # of a pinnacle, in image widths
GOOD_DISTANCE = 0.03  # largest relative standard deviation of the distance of a good calibration
TAPE_ERROR_M = 0.01  # standard deviation of a distance measured with a tape
MAX_HEIGHT_ERROR_M = 0.05  # between measured and computed height of a camera
MIN_PX = 2  # smallest apparent distance and size that determine scale and distance
MARKER_M, OBJECT_M = (0.05, 100.0), (0.05, 10.0)  # allowed distances of the objects, and heights
DISTANCE_M, HEIGHT_M = (0.2, 100.0), (-10.0, 20.0)  # allowed distances of the cameras, and heights


@dataclass(frozen=True)
class Pinnacles:
    """Image positions of A', B', C' in one camera: (column, row), px; the centre of the first pixel is 0.

    distance_m, height_m: of the camera, from the origin along its axis and above the ground; None: not measured.
    """

    a: Pixel
    b: Pixel
    c: Pixel
    distance_m: float | None = None
    height_m: float | None = None


@dataclass(frozen=True)
class Measurements:
    """size: (width, height) px.  d_x, d_z: of C and B, metres, signed.  t: height of the objects, metres."""

    size: tuple[int, int]
    d_x: float
    d_z: float
    t: float
    camera1: Pinnacles
    camera2: Pinnacles


@dataclass(frozen=True)
class SolvedCamera:
    """residuals_px: (3, 2), measured minus projected, of A', B', C'.  remarks: inconsistencies, for people."""

    camera: Camera
    focal_px: float
    distance_m: float
    distance_error_m: float  # standard deviation
    residuals_px: Floats
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class _View:
    """One camera's measurements by role: `beside` is `aside_m` to its right at A's depth, `along` `step_m` beyond A."""

    label: str
    pinnacles: Pinnacles
    beside: Pixel
    aside_m: float
    along: Pixel
    step_m: float
    rotation: Floats


def calibrate_lines(measured: Measurements) -> tuple[SolvedCamera, SolvedCamera]:
    """Return cameras 1 and 2 in the Y-up world with the ground at Y = 0.  [Two-view 4.1]  Raises UserError."""
    check_measurements(measured)
    return solved_camera(measured, 1, "cam01"), solved_camera(measured, 2, "cam02")


def check_measurements(measured: Measurements) -> None:
    """Raise UserError where a size or distance is outside of its range."""
    width, height = measured.size
    if width < 2 or height < 2:
        raise UserError(f"size = {width} x {height}: allowed: at least 2 x 2 px")
    for key, value in (("d_x", measured.d_x), ("d_z", measured.d_z)):
        if not MARKER_M[0] <= abs(value) <= MARKER_M[1]:
            raise UserError(f"{key} = {value}: allowed: {MARKER_M[0]:g} to {MARKER_M[1]:g} m on either side of the origin")
    if not OBJECT_M[0] <= measured.t <= OBJECT_M[1]:
        raise UserError(f"t = {measured.t}: allowed: {OBJECT_M[0]:g} to {OBJECT_M[1]:g} m")


def solved_camera(measured: Measurements, number: int, name: str) -> SolvedCamera:
    """Return camera 1 or 2 from checked measurements.  Raises UserError."""
    one, two = measured.camera1, measured.camera2
    if number == 1:
        to_back = np.diag([1.0, -1.0, -1.0])
        return _solve(_View("camera 1", one, one.c, measured.d_x, one.b, -measured.d_z, to_back), measured, name)
    to_right = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])
    return _solve(_View("camera 2", two, two.b, measured.d_z, two.c, measured.d_x, to_right), measured, name)


def _check_pinnacles(label: str, pinnacles: Pinnacles, size: tuple[int, int]) -> None:
    for name, pixel in (("a", pinnacles.a), ("b", pinnacles.b), ("c", pinnacles.c)):
        if not (-0.5 <= pixel[0] <= size[0] - 0.5 and -0.5 <= pixel[1] <= size[1] - 0.5):
            raise UserError(f"{label}: {name} = {pixel}: allowed: inside the image of {size[0]} x {size[1]} px")
    for key, value, (least, most) in (
        ("distance", pinnacles.distance_m, DISTANCE_M),
        ("height", pinnacles.height_m, HEIGHT_M),
    ):
        if value is not None and not least <= value <= most:
            raise UserError(f"{label}: {key} = {value}: allowed: {least:g} to {most:g} m")


def _solve(view: _View, measured: Measurements, name: str) -> SolvedCamera:
    pinnacles, t = view.pinnacles, measured.t
    _check_pinnacles(view.label, pinnacles, measured.size)
    # Paper (corrected): the marker lines 80/81 and 60/61 of 4.1 are 1-based; the centre is (79.5, 59.5).
    centre_x, centre_y = (measured.size[0] - 1) / 2, (measured.size[1] - 1) / 2
    span = (view.beside[0] - pinnacles.a[0]) / view.aside_m  # λ / d, px per metre at A
    if span * abs(view.aside_m) < MIN_PX:
        raise UserError(
            f"{view.label}: columns {pinnacles.a[0]:g} of A and {view.beside[0]:g} of the object {view.aside_m:+g} m "
            "beside it: allowed: 2 px or more apart, further right for a positive distance; "
            "is the image mirrored or are objects swapped?"
        )
    # A and the object beside it are at one depth: the mean of their rows.
    rows = np.array([(pinnacles.a[1] + view.beside[1]) / 2, view.along[1]]) - centre_y
    distance, error = _distance(view, pinnacles.distance_m, rows)
    # Paper (corrected): 4.1 prints D_Z for lambda_1; it is D_X.
    focal = span * distance
    # Paper (added): 4.1 assumes known distances and cameras at the height 0; here both are solved for.
    height = t + rows[0] / span
    remarks = _remarks(view, measured.size, distance, error, rows, height)
    if pinnacles.height_m is not None:
        height = pinnacles.height_m
    centre = -distance * view.rotation[2] + np.array([0.0, height, 0.0])
    matrix = np.array([[focal, 0.0, centre_x], [0.0, focal, centre_y], [0.0, 0.0, 1.0]])
    camera = Camera(name, measured.size, matrix, np.zeros(4), view.rotation, -view.rotation @ centre)
    points = np.array([[0.0, t, 0.0], [0.0, t, measured.d_z], [measured.d_x, t, 0.0]])
    residuals: Floats = np.array([pinnacles.a, pinnacles.b, pinnacles.c]) - camera.project(points)
    worst, limit = float(np.abs(residuals).max()), MAX_RESIDUAL * measured.size[0]
    if worst > limit:
        remarks.append(f"{view.label}: a pinnacle is {worst:.1f} px off, more than {limit:.1f} px: measure again")
    return SolvedCamera(camera, focal, distance, error, residuals, tuple(remarks))


def _distance(view: _View, tape_m: float | None, rows: Floats) -> tuple[float, float]:
    """Distance and its standard deviation, metres: the tape's, or from the ratio of the apparent sizes."""
    step_m = view.step_m
    if tape_m is not None:
        if tape_m + step_m <= 0:
            raise UserError(f"{view.label}: distance = {tape_m}: allowed: more than the {-step_m:g} m of the marker")
        return tape_m, TAPE_ERROR_M
    advice = "give the measured distance of the camera, or use objects much higher or lower than the camera"
    near, far = rows
    if min(abs(near), abs(far)) < MIN_PX or near * far <= 0 or abs(near - far) < PIXEL_NOISE:
        raise UserError(
            f"{view.label}: pinnacles appear {near:+.1f} and {far:+.1f} px from the centre row: allowed: both on one "
            f"side, 2 px or more from it and of different size, otherwise the distance cannot be determined; {advice}"
        )
    distance = step_m * far / (near - far)
    if not max(DISTANCE_M[0], -step_m) < distance <= DISTANCE_M[1]:
        raise UserError(
            f"{view.label}: the apparent sizes {near:+.1f} and {far:+.1f} px give a distance of {distance:.2f} m: "
            f"allowed: {max(DISTANCE_M[0], -step_m):g} to {DISTANCE_M[1]:g} m; are B and C swapped?  Otherwise {advice}"
        )
    slope = step_m / (near - far) ** 2  # ∂d/∂near = −far · slope, ∂d/∂far = near · slope; near is a mean of two rows
    return float(distance), float(PIXEL_NOISE * abs(slope) * np.hypot(far / np.sqrt(2), near))


def _remarks(view: _View, size: tuple[int, int], distance: float, error: float, rows: Floats, height: float) -> list[str]:
    """Inconsistencies between the redundant measurements and the calibration, for people."""
    pinnacles, label = view.pinnacles, view.label
    limit, centre_x, remarks = MAX_RESIDUAL * size[0], (size[0] - 1) / 2, []
    for name, pixel in (("A", pinnacles.a), ("the object along the axis", view.along)):
        if abs(pixel[0] - centre_x) > limit:
            remarks.append(
                f"{label}: {name} is at column {pixel[0]:.1f}, not within {limit:.1f} px of the centre {centre_x:g}: "
                "turn the camera until the line marker lies on the two middle columns"
            )
    rise, run = abs(view.beside[1] - pinnacles.a[1]), abs(view.beside[0] - pinnacles.a[0])
    if rise > limit:
        angle = np.degrees(np.arctan2(rise, run))
        remarks.append(f"{label}: the line between pinnacles at one depth rises by {angle:.1f} degrees: level the camera")
    if error > GOOD_DISTANCE * distance:
        remarks.append(
            f"{label}: the distance {distance:.2f} m has a standard deviation of {error:.2f} m: measure it with a tape"
        )
    if pinnacles.distance_m is not None and rows[0] * rows[1] > 0 and abs(rows[0] - rows[1]) > MIN_PX:
        solved, spread = _distance(view, None, rows)
        if abs(solved - distance) > 3 * spread + TAPE_ERROR_M:
            sizes = f"the apparent sizes give {solved:.2f} ± {spread:.2f} m"
            remarks.append(f"{label}: measured distance {distance:.2f} m, but {sizes}")
    if pinnacles.height_m is not None and abs(pinnacles.height_m - height) > MAX_HEIGHT_ERROR_M:
        remarks.append(
            f"{label}: measured height {pinnacles.height_m:.2f} m, but the pinnacles give {height:.2f} m: "
            "is the camera level?"
        )
    return remarks
