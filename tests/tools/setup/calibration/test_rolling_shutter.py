"""Rolling shutter in views of a board: named where it is, with its time."""

from dataclasses import replace

import pytest

from tests.support.board_views import BOARD, board_views, room
from tests.support.stored import stored
from zenocap.common.camera.lens import Lens
from zenocap.tools.setup.calibration.board_calibration import BoardCalibration, calibrated_rig
from zenocap.tools.setup.calibration.board_report import report, report_data
from zenocap.tools.setup.calibration.parameters import LEAST_READOUT_S

pytestmark = pytest.mark.slow


def calibrated(readouts_s, delays_s=(), **options) -> BoardCalibration:
    rig = room(2, seed=4)
    views, _ = board_views(rig, seconds=16.0, fps=15.0, readouts_s=readouts_s, delays_s=delays_s, **options)
    return calibrated_rig(BOARD, views, {one.name: Lens.of(one) for one in rig})


@pytest.fixture(scope="module")
def rolled() -> BoardCalibration:
    sources = ("tests.support.board_views", "zenocap.tools.setup.calibration.board_calibration")
    return stored(lambda: calibrated((0.0, 0.025)), "rolling shutter", sources=sources)


def test_it_is_named_in_the_camera_that_has_it(rolled):
    assert [one.rolling_shutter for one in rolled.cameras] == [False, True]
    assert rolled.cameras[1].readout_s == pytest.approx(0.025, abs=0.003)
    assert rolled.cameras[0].readout_s == pytest.approx(0.0, abs=0.003)
    assert rolled.cameras[1].delay_s == pytest.approx(0.0, abs=0.004)


def test_the_report_names_camera_and_time(rolled):
    lines = [line for line in report(rolled) if "rolling shutter" in line]
    assert len(lines) == 1
    assert lines[0].startswith("  rolling shutter of about 2")
    assert " in cam02, from the first to the last row" in lines[0]
    cameras = report_data(rolled)["cameras"]
    assert [one["rolling_shutter"] for one in cameras] == [False, True]  # type: ignore[attr-defined]


@pytest.mark.nightly
def test_cameras_that_are_only_late_have_none():
    found = calibrated((0.0, 0.0), (0.0, -0.06))
    assert [one.rolling_shutter for one in found.cameras] == [False, False]
    assert not any("rolling" in line for line in report(found))


def test_small_or_uncertain_times_are_not_named_and_turned_images_are(rolled):
    small, uncertain, turned = (
        replace(rolled.cameras[0], readout_s=readout_s, readout_error_s=error_s)
        for readout_s, error_s in ((0.9 * LEAST_READOUT_S, 0.0001), (0.02, 0.01), (-0.02, 0.001))
    )
    assert [one.rolling_shutter for one in (small, uncertain, turned)] == [False, False, True]
    text = "\n".join(report(replace(rolled, cameras=(turned,))))
    assert "rolling shutter of about 20 ms ± 1 in cam01" in text
    assert "turned by 180 degrees" in text


@pytest.mark.nightly
def test_pictures_of_a_board_at_rest_have_none():
    rig = room(2, seed=4)
    views, _ = board_views(rig, seconds=16.0, fps=4.0)
    still = [replace(one, still=True) for one in views]
    found = calibrated_rig(BOARD, still, {one.name: Lens.of(one) for one in rig})
    assert [(one.readout_s, one.rolling_shutter) for one in found.cameras] == [(0.0, False)] * 2
