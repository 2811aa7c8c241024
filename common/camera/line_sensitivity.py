"""Effect of an error of one pixel on a calibration by lines, and the errors that no check notices."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product

from zenocap.common.camera.line_calibration import Measurements, Pinnacles, SolvedCamera, solved_camera
from zenocap.common.errors import UserError

MAX_UNDETECTED = 0.1  # relative error of the focal length that may stay undetected in a good calibration; chosen by hand
SEARCHED_ERROR = 0.05  # errors of a pinnacle up to this are searched for undetected ones, in image widths; chosen by hand

COORDINATES = (("column", 0), ("row", 1))


@dataclass(frozen=True)
class Sensitivity:
    """Effects of an error of one coordinate of a pinnacle on the focal length, relative, at least 0.

    pixel: of an error of 1 px in `coordinate`, such as "column of C'", the one with the largest effect.
    undetected: the largest that no check notices, by an error of `undetected_px` px in `undetected_coordinate`.
    """

    pixel: float
    coordinate: str
    undetected: float
    undetected_px: float
    undetected_coordinate: str

    @property
    def checked(self) -> bool:
        """Whether an error that matters would have been noticed."""
        return self.undetected <= MAX_UNDETECTED


def sensitivity(measured: Measurements, number: int, solved: SolvedCamera) -> Sensitivity:
    """Sensitivity of camera 1 or 2; solved: it, from `measured`."""
    pixel, undetected = (0.0, "none"), (0.0, 0.0, "none")
    for name, (word, axis), sign in product("abc", COORDINATES, (-1, 1)):
        coordinate = f"{word} of {name.upper()}'"
        for error_px, effect, noticed in _effects(measured, number, solved, (name, axis), sign):
            if error_px == 1:
                pixel = max(pixel, (effect, coordinate))
            if noticed:
                break
            undetected = max(undetected, (effect, float(error_px), coordinate))
    return Sensitivity(pixel[0], pixel[1], undetected[0], undetected[1], undetected[2])


def pixel_effects(measured: Measurements, number: int, solved: SolvedCamera) -> dict[str, float]:
    """Largest relative change of the focal length by an error of 1 px in A, B and C, of camera 1 or 2, from `measured`."""
    found = {}
    for name in "abc":
        firsts = [
            next(_effects(measured, number, solved, (name, axis), sign), None)
            for (_, axis), sign in product(COORDINATES, (-1, 1))
        ]
        found[name.upper()] = max((first[1] for first in firsts if first is not None), default=0.0)
    return found


def _effects(
    measured: Measurements, number: int, solved: SolvedCamera, coordinate: tuple[str, int], sign: int
) -> Iterator[tuple[int, float, bool]]:
    """Errors of a coordinate from 1 px on, px, their relative effect on the focal length, and whether a remark is new."""
    right = measured.camera1 if number == 1 else measured.camera2
    for error_px in range(1, max(1, round(SEARCHED_ERROR * measured.size[0])) + 1):
        moved = _moved(right, coordinate, sign * error_px)
        wrong = replace(measured, camera1=moved) if number == 1 else replace(measured, camera2=moved)
        try:
            found = solved_camera(wrong, number, solved.camera.name)
        except UserError:  # noticed
            return
        yield error_px, abs(found.focal_px / solved.focal_px - 1.0), len(found.remarks) > len(solved.remarks)


def _moved(pinnacles: Pinnacles, coordinate: tuple[str, int], by_px: float) -> Pinnacles:
    name, axis = coordinate
    pixels = {"a": pinnacles.a, "b": pinnacles.b, "c": pinnacles.c}
    column, row = pixels[name]
    pixels[name] = (column + by_px, row) if axis == 0 else (column, row + by_px)
    return replace(pinnacles, a=pixels["a"], b=pixels["b"], c=pixels["c"])
