"""The refinements by number, so that compiled code can choose."""

from numba import njit

from common.body.anatomy import Floats
from services.tracker.closest import Singles
from services.tracker.force import refine_by_force
from services.tracker.force_printed import refine_as_printed
from services.tracker.model import Model
from services.tracker.refine import Weights, refine
from services.tracker.room import Room

REFINEMENTS = ("gauss-newton", "force", "force-printed")
GAUSS_NEWTON, FORCE, FORCE_PRINTED = range(3)


@njit(cache=True, error_model="numpy")
def refine_by(
    kind: int,
    model: Model,
    rays: Singles,
    room: Room,
    weights: Weights,
    iterations: int,
    position: Floats,
    rotation: Floats,
    values: Floats,
    target_position: Floats,
    target_rotation: Floats,
    target_values: Floats,
) -> None:
    """Move a pose in place as `refine` does; kind: index in REFINEMENTS.  Forces know of no room, as in the paper."""
    if kind == FORCE:
        refine_by_force(
            model, rays, weights, iterations, position, rotation, values,
            target_position, target_rotation, target_values,
        )  # fmt: skip
    elif kind == FORCE_PRINTED:
        refine_as_printed(
            model, rays, weights, iterations, position, rotation, values,
            target_position, target_rotation, target_values,
        )  # fmt: skip
    else:
        refine(
            model, rays, room, weights, iterations, position, rotation, values,
            target_position, target_rotation, target_values,
        )  # fmt: skip
