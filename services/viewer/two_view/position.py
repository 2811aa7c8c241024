"""Object tracking in one view: position of the navel, tilt and turn of the torso.  [Two-view 3.2]"""

from dataclasses import dataclass

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.segments import YAW_OFFSETS
from zenocap.common.jit import kernel
from zenocap.services.viewer.parameters import (
    LONGEST_LEG,
    PAPER_ROWS,
    SHIFT_ROUNDS,
    SHIFTS_PX,
    STRAIGHT_KNEE_M,
    TILT_PIVOTS,
    TILT_REGION,
    TILT_STOP,
)
from zenocap.services.viewer.two_view.body_fit import ARMLESS, WHOLE, BodyFit, PersonSizes, cover_body
from zenocap.services.viewer.two_view.limb_search import CoverImage, turn_vector

SHIFTS = np.array(SHIFTS_PX)


@dataclass(frozen=True)
class TorsoEstimate:
    """Torso in one view.

    position: (3,) navel at the assumed depth, metres.  score: matching score there.  tilt: turn of the torso about the view
    axis, radians.  turns: log matching scores of the whole body turned by `YAW_OFFSETS` about the vertical.
    """

    position: Floats
    score: float
    tilt: float
    turns: tuple[float, ...]


def estimate_torso(
    fit: BodyFit, position: Floats, torso_to_world: Floats, directions: Floats, *, tilted: bool = True, turned: bool = True
) -> TorsoEstimate:
    """Shift the model image to the silhouette, then tilt and turn its torso.  Leaves the fit at the position found.

    position: (3,), torso_to_world: (3, 3), directions: (4, 2, 3) of the predicted pose.
    tilted, turned: False to leave out the tilt, or the scores of the turns.
    """
    # Paper (replaced): 3.2 shifts the whole model; without arms an arm that moved does not move the torso.
    coarse = max(1, round(fit.image_rows / PAPER_ROWS))
    fit.place(position, torso_to_world, directions)
    step = fit.metres_per_pixel()
    shape = fit.model, fit.image
    found, _ = shift_body(position, torso_to_world, directions, *shape, step, coarse, False)
    torso, limbs = torso_to_world.copy(), directions.copy()
    tilt = tilt_of(fit, found, torso, limbs) if tilted else 0.0
    found, _ = shift_body(found, torso, limbs, *shape, step, coarse, True)
    turns = turn_scores(found, torso, limbs, *shape, YAW_OFFSETS) if turned else ()
    score = fit.place(found, torso_to_world, directions)
    return TorsoEstimate(found, float(score), float(tilt), tuple(float(turn) for turn in turns))


def tilt_of(fit: BodyFit, position: Floats, torso_to_world: Floats, directions: Floats) -> float:
    """Turn of the torso about the view axis, radians; position (3,), torso_to_world (3, 3), directions (4, 2, 3) follow it.

    The fit must have been placed with the same torso.
    """
    axis = torso_to_world @ fit.view_axis
    tilt = 0.0
    for height in TILT_PIVOTS:
        tilt += tilt_body(
            position, torso_to_world, directions, axis, height * float(fit.model.neck[1]), fit.model, fit.image
        )
    return float(tilt)


@kernel
def shift_body(
    position: Floats, torso_to_world: Floats, directions: Floats, model: PersonSizes, image: CoverImage,
    metres_per_px: float, coarse: int, keep_feet: bool,
) -> tuple[Floats, float]:  # fmt: skip
    """Shift the model without arms in the image to its best matching score, first in steps of `coarse` px, then of one.

    keep_feet: the feet keep their positions, see `keep_feet_in_place`.
    Returns the new navel (3,) and the score; cover and totals are those of the last trial.
    """
    # Paper (corrected): 3.2 omits the shift 0; here it is the current position, so that a good one is kept.
    # Paper (replaced): 3.2 shifts once along X and once along Y; here repeatedly, from coarse to fine.
    limbs = directions.copy()
    best = position.copy()
    best_score = cover_body(best, torso_to_world, directions, model, image, ARMLESS)
    scale = coarse
    while True:
        for _ in range(SHIFT_ROUNDS):
            start = best.copy()
            for axis in range(2):
                for shift in SHIFTS:
                    trial = start.copy()
                    for k in range(3):
                        trial[k] += shift * scale * metres_per_px * image.camera[axis, k]
                    if keep_feet:
                        keep_feet_in_place(position, torso_to_world, directions, trial, torso_to_world, model, limbs)
                    score = cover_body(trial, torso_to_world, limbs, model, image, ARMLESS)
                    if score > best_score:
                        best, best_score = trial, score
            if best[0] == start[0] and best[1] == start[1] and best[2] == start[2]:
                break
        if scale == 1:
            return best, best_score
        scale = 1


@kernel
def turn_scores(
    position: Floats, torso_to_world: Floats, directions: Floats, model: PersonSizes, image: CoverImage, turns: Floats
) -> Floats:
    """(n,) log matching scores of the whole body turned by `turns` (n,) radians about the vertical."""
    # Paper (replaced): 3.1 turns the torso by quarter turns; here both viewers score turns about the last yaw.
    scores = np.empty(turns.shape[0])
    turned = np.empty((3, 3))
    for k in range(turns.shape[0]):
        c, s = np.cos(turns[k]), np.sin(turns[k])
        for column in range(3):
            turned[0, column] = c * torso_to_world[0, column] + s * torso_to_world[2, column]
            turned[1, column] = torso_to_world[1, column]
            turned[2, column] = c * torso_to_world[2, column] - s * torso_to_world[0, column]
        scores[k] = np.log(cover_body(position, turned, directions, model, image, WHOLE) + 1e-3)
    return scores


@kernel
def tilt_body(
    position: Floats, torso_to_world: Floats, directions: Floats, axis: Floats, height: float, model: PersonSizes,
    image: CoverImage,
) -> float:  # fmt: skip
    """Tilt torso and head about `axis` (3,) of the world by an overlapped tri-tree search; returns the angle, radians.

    The point at `height` metres above the navel and the feet keep their positions.  position (3,), torso_to_world (3, 3)
    and directions (4, 2, 3) are changed in place.  Of equal scores the smaller tilt is taken.
    """
    # Paper (added): in 3 the torso stays upright, so that a bend of the person appears as a shift.
    trial, turned, turned_directions = np.empty(3), np.empty((3, 3)), np.empty((4, 2, 3))
    best, best_score = 0.0, -1.0
    centre, width = 0.0, TILT_REGION
    while width > TILT_STOP * 1.001:
        winner, winner_score = 0.0, -1.0
        for part in (0.0, -0.5, 0.5):
            angle = centre + part * width
            _tilt(position, torso_to_world, directions, axis, height, angle, model, trial, turned, turned_directions)
            score = cover_body(trial, turned, turned_directions, model, image, ARMLESS)
            if score > winner_score:
                winner, winner_score = part, score
            if score > best_score or (score == best_score and abs(angle) < abs(best)):
                best, best_score = angle, score
        centre += winner / 2 * width
        width /= 2
    _tilt(position, torso_to_world, directions, axis, height, best, model, trial, turned, turned_directions)
    for row in range(3):  # no slice assignments, see `turn_limb`
        position[row] = trial[row]
        for k in range(3):
            torso_to_world[row, k] = turned[row, k]
    for limb in range(4):
        for part in range(2):
            for row in range(3):
                directions[limb, part, row] = turned_directions[limb, part, row]
    return best


@kernel
def _tilt(
    position: Floats, torso_to_world: Floats, directions: Floats, axis: Floats, height: float, angle: float,
    model: PersonSizes, trial: Floats, turned: Floats, turned_directions: Floats,
) -> None:  # fmt: skip
    """Write trial (3,), turned (3, 3), turned_directions (4, 2, 3): navel, torso and limbs after a tilt by `angle`."""
    column, turned_column = np.empty(3), np.empty(3)
    for k in range(3):
        for row in range(3):
            column[row] = torso_to_world[row, k]
        turn_vector(column, axis, angle, turned_column)
        for row in range(3):
            turned[row, k] = turned_column[row]
    for row in range(3):
        trial[row] = position[row] + height * (torso_to_world[row, 1] - turned[row, 1])
    keep_feet_in_place(position, torso_to_world, directions, trial, turned, model, turned_directions)


@kernel
def keep_feet_in_place(
    position: Floats, torso_to_world: Floats, directions: Floats, moved: Floats, turned: Floats, model: PersonSizes,
    out: Floats,
) -> None:  # fmt: skip
    """Write limb directions (4, 2, 3) after the torso moved from `position`, `torso_to_world` to `moved`, `turned`.

    The arms keep their directions in the world, the feet their positions.  Each knee stays on its side of the line from hip
    to foot, and a straight leg bends to the front.  A foot out of reach moves along.
    """
    part = np.empty((2, 3))
    for limb in range(4):
        for row in range(3):
            for k in range(2):
                part[k, row] = 0.0
                for column in range(3):
                    part[k, row] += torso_to_world[row, column] * directions[limb, k, column]
        if limb >= 2:
            _keep_foot(position, torso_to_world, moved, turned, model, limb, part)
        for k in range(2):
            for column in range(3):
                out[limb, k, column] = 0.0
                for row in range(3):
                    out[limb, k, column] += turned[row, column] * part[k, row]


@kernel
def _keep_foot(
    position: Floats, torso_to_world: Floats, moved: Floats, turned: Floats, model: PersonSizes, limb: int, part: Floats
) -> None:
    """Turn the parts (2, 3) of a leg, directions in the world, so that its foot stays; see `keep_feet_in_place`."""
    upper, lower = model.limbs[limb, 0, 0], model.limbs[limb, 1, 0]
    knee, foot, distance = np.empty(3), np.empty(3), 0.0
    for row in range(3):
        hip = moved[row] - position[row]
        for column in range(3):
            hip += (turned[row, column] - torso_to_world[row, column]) * model.origins[limb, column]
        knee[row] = upper * part[0, row] - hip
        foot[row] = knee[row] + lower * part[1, row]
        distance += foot[row] ** 2
    distance = np.sqrt(distance)
    if distance <= abs(upper - lower) + 1e-3:
        return
    along = foot / distance
    distance = min(distance, LONGEST_LEG * (upper + lower))
    side = knee - (knee[0] * along[0] + knee[1] * along[1] + knee[2] * along[2]) * along
    norm = np.sqrt(side[0] ** 2 + side[1] ** 2 + side[2] ** 2)
    if norm < STRAIGHT_KNEE_M:
        for row in range(3):
            side[row] += STRAIGHT_KNEE_M * turned[row, 2]
        norm = np.sqrt(side[0] ** 2 + side[1] ** 2 + side[2] ** 2)
    reach = (upper**2 - lower**2 + distance**2) / (2 * distance)
    bend = np.sqrt(max(upper**2 - reach**2, 0.0))
    for row in range(3):
        bent = reach * along[row] + bend * side[row] / max(norm, 1e-9)
        part[0, row] = bent / upper
        part[1, row] = (distance * along[row] - bent) / lower
