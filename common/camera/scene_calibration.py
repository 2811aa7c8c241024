"""Pose of a camera from known points of the room and their pixels.

The pose minimizes the squared distances in the image.  Without a lens its focal length is estimated too: square pixels, the
principal point in the middle of the image, no distortion.

How much a wrong pixel matters is reliability theory (Baarda 1968, A testing procedure for use in geodetic networks).  With
J the Jacobian of the 2 n pixel coordinates, N = JᵀJ and R = I - J N⁻¹ Jᵀ, coordinate i is checked by the others by its
redundancy r_i = R_ii, from 0 to 1.  An error of it is noticed from NOTICED σ / √r_i on; one just below that moves the
solution by N⁻¹ Jᵀ e_i NOTICED σ / √r_i.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations, islice

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.camera.lens import Lens
from zenocap.common.camera.pinhole import Camera
from zenocap.common.camera.scene_pose import Picks, ScenePose, fitted_poses
from zenocap.common.errors import UserError

# All values below are chosen by hand.
CLICK_PX = 1.0  # standard deviation of a pixel that a person picks
NOTICED = 4.0  # standard deviations of a residual from which an error is noticed
FEWEST, FEWEST_WITHOUT_LENS = 4, 6  # points
MIN_SPREAD = 0.05  # smallest extent of the points relative to the largest: less is a line, or without a lens a plane
PERSON_M = 1.0  # height above the floor of the place at which errors are stated
MIRRORED = 0.2  # the mirrored image fits when it leaves less than this share of the residuals
EXCHANGED = 0.2  # the same of two points that are exchanged; of another pair, 1 / EXCHANGED_APART times as much is left
EXCHANGED_APART = 0.5
MOST_EXCHANGES = 66  # pairs that are tried, those of twelve points: each costs a fit
AMBIGUOUS_PX, AMBIGUOUS_M = 1.0, 0.1  # another pose fits as well: difference of its residuals, and its distance


@dataclass(frozen=True)
class PlacedCamera:
    """A camera and how far it can be trusted.

    Errors are of the place of a person in the middle of the points, 1 m above the floor, across the camera's view.

    residuals_px: (n, 2), picked minus projected, in the order of `points`.
    per_pixel_m: (n,), error by a pick that is 1 px off in the direction that matters most.
    error_m: standard deviation, from picks that are CLICK_PX off, or more where the residuals are larger.
    suspect: the point that contradicts the others most, and its distance in px from where they put it; None: no point does.
    unnoticed: the point whose wrong pick matters most, its largest unnoticed error in px, and the error
    that follows, m.  Both are infinite for a point that no other one checks.
    remarks: faults, for people.
    """

    camera: Camera
    points: tuple[str, ...]
    residuals_px: Floats
    per_pixel_m: Floats
    error_m: float
    suspect: tuple[str, float] | None
    unnoticed: tuple[str, float, float]
    remarks: tuple[str, ...]

    @property
    def residual_px(self) -> float:
        """Root mean square distance of the picked points from the projected ones."""
        return float(np.sqrt((self.residuals_px**2).sum(axis=1).mean()))


def placed_camera(
    name: str, size: tuple[int, int], points: Mapping[str, tuple[float, float, float]],
    pixels: Mapping[str, tuple[float, float]], lens: Lens | None = None,
) -> PlacedCamera:  # fmt: skip
    """Return the camera that sees `points` (world with Y up, m) at `pixels`.

    size: (width, height) of its images, px.  Raises UserError when the points do not suffice.
    """
    names = tuple(pixels)
    world = np.array([points[key] for key in names])
    picks = Picks(world, np.array([pixels[key] for key in names]), size, lens)
    _check_points(name, world, lens)
    try:
        pose, *others = fitted_poses(picks)
    except UserError as error:
        if (exchanged := _exchanged_points(picks, np.inf)) is not None:
            raise UserError(f"{name}: {_exchange_text(names, exchanged)}") from error
        raise UserError(f"{name}: {error}") from error
    jacobian, residuals = pose.jacobian(world), picks.seen - pose.project(world)
    inverse: Floats = np.asarray(np.linalg.pinv(jacobian.T @ jacobian), dtype=np.float64)
    redundancy: Floats = np.clip(1.0 - ((jacobian @ inverse) * jacobian).sum(axis=1), 0.0, 1.0)
    middle = np.array([world[:, 0].mean(), PERSON_M, world[:, 2].mean()])
    effect = pose.place_jacobian(middle)
    free = residuals.size - jacobian.shape[1]
    noise = max(CLICK_PX, float(np.sqrt((residuals**2).sum() / free)) if free else 0.0)
    spread = float(np.sqrt(np.trace(effect @ inverse @ effect.T)))
    suspect = _suspect(names, picks, residuals, redundancy)
    exchanged = None if suspect is None else _exchanged_points(picks, pose.residual_px(picks))
    if exchanged is not None:
        remarks: tuple[str, ...] = (f"{name}: {_exchange_text(names, exchanged)}",)
    else:
        remarks = _remarks(name, pose, others, picks)
    if suspect is not None and not remarks:
        remarks = (
            f"{name}: {suspect[0]} is {suspect[1]:.1f} px from where the other points put it: pick or measure it again",
        )
    moves = effect @ inverse @ jacobian.T  # (2, 2 n), metres by 1 px
    unnoticed = _unnoticed(names, moves, redundancy)
    per_pixel = np.linalg.norm(moves.reshape(2, -1, 2).transpose(1, 0, 2), ord=2, axis=(1, 2))
    return PlacedCamera(pose.camera(name), names, residuals, per_pixel, noise * spread, suspect, unnoticed, remarks)


def _exchange_text(names: tuple[str, ...], exchanged: tuple[int, int]) -> str:
    one, other = (names[place] for place in exchanged)
    return f"{one} and {other} seem to be exchanged: with each at the other's pixel all points fit"


def _exchanged_points(picks: Picks, residual_px: float) -> tuple[int, int] | None:
    """Two points whose pixels are exchanged, by number: all fit when these are put right; None: no such two.

    residual_px: root mean square residual as they are.
    """
    found: list[tuple[float, tuple[int, int]]] = []
    for one, other in islice(combinations(range(len(picks.world)), 2), MOST_EXCHANGES):
        order = np.arange(len(picks.world))
        order[[one, other]] = other, one
        changed = replace(picks, seen=picks.seen[order])
        try:
            left_px = fitted_poses(changed, most=1)[0].residual_px(changed)
        except UserError:
            continue
        found.append((left_px, (one, other)))
    found.sort()
    if not found or found[0][0] > max(EXCHANGED * residual_px, CLICK_PX) or found[0][0] > NOTICED * CLICK_PX:
        return None
    if len(found) > 1 and found[1][0] * EXCHANGED_APART < found[0][0]:
        return None  # two ways to put it right: none is certain
    return found[0][1]


def _check_points(name: str, world: Floats, lens: Lens | None) -> None:
    fewest = FEWEST if lens is not None else FEWEST_WITHOUT_LENS
    if len(world) < fewest:
        hint = "" if lens is not None else f", or a lens file and {FEWEST}"
        raise UserError(f"{name}: {len(world)} points: allowed: at least {fewest}{hint}")
    extents = np.linalg.svd(world - world.mean(axis=0), compute_uv=False)
    if extents[1] < MIN_SPREAD * extents[0]:
        raise UserError(f"{name}: all points lie on one line: allowed: points apart from it")
    if lens is None and extents[2] < MIN_SPREAD * extents[0]:
        raise UserError(
            f"{name}: all points lie in one plane: allowed: without a lens file, points at different heights as well, such "
            "as the tops of upright poles"
        )


def _suspect(names: tuple[str, ...], picks: Picks, residuals: Floats, redundancy: Floats) -> tuple[str, float] | None:
    """The point with the largest normalized residual, if that is an error, and how far the others put it away."""
    normalized = np.abs(residuals.ravel()) / (CLICK_PX * np.sqrt(np.maximum(redundancy, 1e-9)))
    worst = np.where(redundancy > 1e-6, normalized, 0.0).reshape(-1, 2).max(axis=1)
    place = int(worst.argmax())
    if worst[place] < NOTICED:
        return None
    rest = np.arange(len(names)) != place
    if rest.sum() < (FEWEST if picks.lens is not None else FEWEST_WITHOUT_LENS):
        return names[place], float(np.hypot(*residuals[place]))
    pose = fitted_poses(replace(picks, world=picks.world[rest], seen=picks.seen[rest]))[0]
    return names[place], float(np.hypot(*(picks.seen[place] - pose.project(picks.world[place : place + 1])[0])))


def _unnoticed(names: tuple[str, ...], moves: Floats, redundancy: Floats) -> tuple[str, float, float]:
    limits = NOTICED * CLICK_PX / np.sqrt(np.maximum(redundancy, 1e-12))
    limits[redundancy < 1e-6] = np.inf
    moved = np.linalg.norm(moves, axis=0)
    errors = np.where(np.isfinite(limits), moved * np.where(np.isfinite(limits), limits, 0.0), np.inf)
    place = int(errors.argmax())
    return names[place // 2], float(limits[place]), float(errors[place])


def _remarks(name: str, pose: ScenePose, others: list[ScenePose], picks: Picks) -> tuple[str, ...]:
    remarks = []
    centre, residual = pose.camera(name).centre, pose.residual_px(picks)
    for other in others:
        apart = float(np.linalg.norm(other.camera(name).centre - centre))
        if other.residual_px(picks) < residual + AMBIGUOUS_PX and apart > AMBIGUOUS_M:
            x, y, z = other.camera(name).centre
            remarks.append(
                f"{name}: could as well stand at ({x:.2f}, {y:.2f}, {z:.2f}) m: add points at other heights and nearer ones"
            )
            break
    if residual > NOTICED * CLICK_PX and _fits_mirrored(picks, residual):
        remarks.append(
            f"{name}: fits as a mirrored image: switch off mirroring in the camera, or X or Z has the wrong sign"
        )
    elif centre[1] <= 0.0:
        remarks.append(
            f"{name}: would stand {-centre[1]:.2f} m below the floor: is the image mirrored, or has X or Z a wrong sign?"
        )
    return tuple(remarks)


def _fits_mirrored(picks: Picks, residual_px: float) -> bool:
    mirrored = replace(picks, seen=np.stack([picks.size[0] - 1 - picks.seen[:, 0], picks.seen[:, 1]], axis=1))
    return fitted_poses(mirrored)[0].residual_px(mirrored) < MIRRORED * residual_px
