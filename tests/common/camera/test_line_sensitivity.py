"""Sensitivity of the calibration by lines: effects of one pixel, and errors that no check notices."""

from dataclasses import replace

import pytest

from tests.common.camera.test_line_calibration import measure, paper
from zenocap.common.camera.line_calibration import Measurements, calibrate_lines
from zenocap.common.camera.line_sensitivity import Sensitivity, sensitivity

SIZE = (640, 480)


def found(measured: Measurements) -> Sensitivity:
    return sensitivity(measured, 1, calibrate_lines(measured)[0])


def with_distance(measured: Measurements, height_m: float | None = None) -> Measurements:
    return replace(measured, camera1=replace(measured.camera1, distance_m=5.2, height_m=height_m))


@pytest.mark.parametrize("d_x", [0.5, 1.0, -1.0])
def test_one_pixel_matters_by_its_share_of_the_distance_in_the_image(d_x):
    measured = with_distance(measure(*paper(SIZE, 600.0), d_x, 1.0, 1.7))
    one = found(measured)
    assert one.pixel == pytest.approx(5.2 / 600.0 / abs(d_x), rel=0.02)
    assert one.coordinate in ("column of A'", "column of C'")


def test_an_unchecked_column_may_be_wrong_by_all_that_was_searched_and_a_measured_height_checks_it():
    measured = measure(*paper(SIZE, 600.0), 1.0, 1.0, 1.7)
    alone, checked = found(with_distance(measured)), found(with_distance(measured, 1.0))
    assert (alone.undetected_coordinate, alone.undetected_px) == ("column of C'", 0.05 * SIZE[0])
    assert not alone.checked
    assert checked.checked
    assert checked.undetected < alone.undetected / 3


def test_the_undetected_error_is_the_one_that_it_says():
    measured = with_distance(measure(*paper(SIZE, 600.0), 1.0, 1.0, 1.7), 1.0)
    one, right = found(measured), calibrate_lines(measured)[0]
    name, axis = one.undetected_coordinate[-2].lower(), int(one.undetected_coordinate.startswith("row"))
    effects = []
    for sign in (-1, 1):
        pixel = list(getattr(measured.camera1, name))
        pixel[axis] += sign * one.undetected_px
        wrong = replace(measured, camera1=replace(measured.camera1, **{name: tuple(pixel)}))
        solved = calibrate_lines(wrong)[0]
        effects.append(abs(solved.focal_px / right.focal_px - 1.0) if not solved.remarks else 0.0)
    assert max(effects) == pytest.approx(one.undetected)
