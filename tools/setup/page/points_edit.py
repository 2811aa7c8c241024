"""Changes of points in pictures: added, moved, renamed, removed, placed, measured."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

from zenocap.common.errors import UserError
from zenocap.tools.setup.page.parameters import MOST_POINTS
from zenocap.tools.setup.page.point_messages import RemovePoint, RenamePoint, SetPoint
from zenocap.tools.setup.page.points_task import Pixel, Placed

T = TypeVar("T")


def edited(placed: Placed, command: SetPoint | RenamePoint | RemovePoint) -> Placed:
    """With a point added, moved, renamed or removed.  Raises UserError."""
    name, points = command.point, dict(placed.points)
    if isinstance(command, SetPoint):
        if name not in points and len(points) >= MOST_POINTS:
            raise UserError(f"{len(points)} points: allowed: up to {MOST_POINTS}")
        if name == "size":
            raise UserError("a point of the name size: allowed: any other name")
        return replace(placed, points={**points, name: command.place})
    if name not in points:
        raise UserError(f"{name}: no such point; there are: {', '.join(points) or 'none'}")
    if isinstance(command, RemovePoint):
        picks = {camera: _without(pixels, name) for camera, pixels in placed.picks.items()}
        return replace(placed, points=_without(points, name), picks=picks)
    to = command.to
    if to in points or to == "size":
        raise UserError(f"{name}: renamed to {to}: allowed: a name that no other point has, and not size")
    renamed = {to if key == name else key: place for key, place in points.items()}
    picks = {
        camera: {to if key == name else key: pixel for key, pixel in pixels.items()}
        for camera, pixels in placed.picks.items()
    }
    return replace(placed, points=renamed, picks=picks)


def picked(placed: Placed, name: str, point: str, pixel: Pixel | None) -> Placed:
    """With a point at a pixel of a camera's picture, or without it there.  Raises UserError."""
    if name not in placed.sizes:
        raise UserError(f"{name}: no picture yet, or no such camera")
    if point not in placed.points:
        raise UserError(f"{point}: no such point; there are: {', '.join(placed.points) or 'none: add one'}")
    if problem := placed.size_problem(name):
        raise UserError(problem)
    own = dict(placed.picks.get(name, {}))
    if pixel is None:
        own.pop(point, None)
    else:
        width, height = placed.sizes[name]
        if not (-0.5 <= pixel[0] <= width - 0.5 and -0.5 <= pixel[1] <= height - 0.5):
            raise UserError(
                f"{name}: {point} = ({pixel[0]:g}, {pixel[1]:g}): allowed: inside the picture of {width} x {height} px"
            )
        own[point] = pixel
    sizes = {**placed.picked_sizes, name: placed.sizes[name]} if own else _without(placed.picked_sizes, name)
    return replace(placed, picks={**placed.picks, name: own}, picked_sizes=sizes)


def cleared(placed: Placed, name: str) -> Placed:
    """Without the points in the picture of a camera."""
    if name not in placed.picks:
        return placed
    return replace(placed, picks={**placed.picks, name: {}}, picked_sizes=_without(placed.picked_sizes, name))


def measured(placed: Placed, key: str, value: float | None) -> Placed:
    """With a measured quantity.  Raises UserError."""
    if key not in placed.fields:
        raise UserError(f"{key}: allowed: {', '.join(placed.fields) or 'no measure on this page'}")
    return replace(placed, fields={**placed.fields, key: value})


def _without(table: Mapping[str, T], key: str) -> dict[str, T]:
    return {name: value for name, value in table.items() if name != key}
