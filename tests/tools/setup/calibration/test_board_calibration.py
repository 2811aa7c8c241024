"""Calibration with a board on simulated views: truth found, errors as claimed."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.board_views import BOARD, board_views, places, rig_error_m, room, with_fisheye
from tests.support.stored import stored
from zenocap.common.camera.lens import Lens
from zenocap.common.camera.pinhole import Camera
from zenocap.common.errors import UserError
from zenocap.tools.setup.calibration.board_calibration import BoardCalibration, calibrated_rig
from zenocap.tools.setup.calibration.board_report import report, report_data, verdict
from zenocap.tools.setup.calibration.board_views import CameraViews

pytestmark = pytest.mark.slow
SHORT = {"seconds": 16.0, "fps": 8.0}
FEW = {"seconds": 10.0, "fps": 5.0}  # enough for known lenses


def cameras_of(found: BoardCalibration) -> list[Camera]:
    return [one.camera for one in found.cameras]


def lenses_of(cameras) -> dict[str, Lens]:
    return {one.name: Lens.of(one) for one in cameras}


def later(seen: CameraViews, by_s: float) -> CameraViews:
    return replace(seen, views=tuple(replace(one, time_s=one.time_s + by_s) for one in seen.views))


@pytest.fixture(scope="module")
def rig() -> tuple[Camera, ...]:
    return room(3, seed=1)


@pytest.fixture(scope="module")
def seen(rig) -> list[CameraViews]:
    return board_views(rig, **FEW)[0]


@pytest.fixture(scope="module")
def found(rig) -> BoardCalibration:
    def make() -> BoardCalibration:
        views, _ = board_views(rig[:2], delays_s=(0.0, 0.04), floor_s=13.0, **SHORT)
        return calibrated_rig(BOARD, views, floor_s=[14.5])

    sources = ("tests.support.board_views", "zenocap.tools.setup.calibration.board_calibration")
    return stored(make, "board calibration", SHORT, sources=sources)


def test_places_are_measured_within_the_claimed_error(rig, found):
    error_m = rig_error_m(cameras_of(found), rig[:2], places())
    assert error_m < 0.004
    assert error_m < 3.0 * found.error_m < 0.02


def test_delays_and_lenses_are_found(rig, found):
    np.testing.assert_allclose([one.delay_s for one in found.cameras], [0.0, 0.04], atol=0.006)
    for one, true in zip(found.cameras, rig[:2], strict=True):
        assert one.camera.matrix[0, 0] == pytest.approx(true.matrix[0, 0], rel=0.02)


def test_the_floor_is_that_of_the_board(rig, found):
    # The board lies in the middle of the room with its rows along X, so that the worlds are the same.
    assert found.world.known
    assert not any(camera.guessed for camera in cameras_of(found))
    for one, true in zip(found.cameras, rig[:2], strict=True):
        np.testing.assert_allclose(one.camera.centre, true.centre, atol=0.1)


def test_without_a_floor_the_vertical_is_guessed_and_the_verdict_says_so(rig, seen):
    guessed = calibrated_rig(BOARD, seen, lenses_of(rig), delays=False)
    word, reasons = verdict(guessed)
    assert word == "poor"
    assert "the floor is not known: lay the board on it and give --floor SECONDS" in reasons[-1]
    assert {camera.guessed for camera in cameras_of(guessed)} == {("vertical",)}  # also in the file that is written
    assert rig_error_m(cameras_of(guessed), rig, places()) < 0.002


def test_given_lenses_stay(rig, seen):
    """And a guess of their size is replaced by that of the images."""
    guessed = {name: replace(one, size=(1300, 740), guessed=("size",)) for name, one in lenses_of(rig).items()}
    kept = calibrated_rig(BOARD, seen, guessed)
    for one, true in zip(kept.cameras, rig, strict=True):
        np.testing.assert_array_equal(one.camera.matrix, true.matrix)
        assert (one.camera.size, one.camera.guessed) == ((1280, 720), ("vertical",))
    with pytest.raises(UserError, match="no lens of cam02; there are: cam01, cam03"):
        calibrated_rig(BOARD, seen, lenses_of((rig[0], rig[2])))
    small = {name: replace(one, size=(640, 360)) for name, one in lenses_of(rig).items()}
    with pytest.raises(UserError, match="cam01: images of 1280 x 720 px, its lens is of 640 x 360"):
        calibrated_rig(BOARD, seen, small)


@pytest.mark.nightly
def test_a_fisheye_rig_with_given_lenses_is_calibrated():
    wide = tuple(with_fisheye(one) for one in room(2, seed=3))
    views, _ = board_views(wide, **FEW)
    found = calibrated_rig(BOARD, views, lenses_of(wide), delays=False)
    assert all(one.camera.fisheye is not None for one in found.cameras)
    assert rig_error_m(cameras_of(found), wide, places()) < 0.004


def test_wrong_views_are_left_out_and_counted(rig, seen):
    wrong = seen[1].views[10]
    moved = replace(wrong, pixels=wrong.pixels + np.array([60.0, -45.0]))
    spoilt = replace(seen[1], views=tuple(moved if one is wrong else one for one in seen[1].views))
    found = calibrated_rig(BOARD, [seen[0], spoilt, seen[2]], lenses_of(rig), delays=False)
    assert rig_error_m(cameras_of(found), rig, places()) < 0.002


@pytest.mark.nightly
def test_videos_that_began_at_different_times_are_poor_and_the_reason_names_that(rig):
    views, _ = board_views(rig, floor_s=13.0, **SHORT)
    found = calibrated_rig(BOARD, [views[0], later(views[1], 2.0), views[2]], lenses_of(rig), floor_s=[14.5])
    assert rig_error_m(cameras_of(found), rig, places()) > 0.05
    word, reasons = verdict(found)
    assert word == "poor"
    assert any("did the videos begin at different times (zenocap sync)" in reason for reason in reasons)


def test_unknown_errors_are_poor(found):
    assert verdict(found)[0] == "good"
    unknown = replace(found, error_m=float("nan"))
    assert verdict(unknown) == ("poor", ["the expected error is unknown: no two cameras see the board at enough places"])
    lost = replace(found, cameras=(replace(found.cameras[0], residual_px=float("nan")), *found.cameras[1:]))
    assert verdict(lost)[0] == "poor"


@pytest.mark.nightly
def test_cameras_that_share_no_view_are_named(rig, seen):
    with pytest.raises(UserError, match="cam03"):
        calibrated_rig(BOARD, [seen[0], seen[1], later(seen[2], 100.0)])


def test_a_camera_with_few_views_is_named(rig, seen):
    few = replace(seen[1], views=seen[1].views[:3])
    too_few = "cam02: the board is found in 3 images, 3 of them of different places: allowed: 4 or more"
    with pytest.raises(UserError, match=too_few):
        calibrated_rig(BOARD, [seen[0], few, seen[2]])


@pytest.mark.nightly
def test_a_time_without_the_board_on_the_floor_is_refused(rig, seen):
    for time_s, text in ((99.0, r"the board is not seen within 0\.5 s"), (5.0, r"the board moves there, by \d+ px/s")):
        steps = []
        with pytest.raises(UserError, match=f"--floor {time_s:g}: {text}"):
            calibrated_rig(BOARD, seen, lenses_of(rig), floor_s=[time_s], on_progress=steps.append)
        assert bool(steps) == (time_s < 99)  # a time without the board: before the work


def test_the_report_has_every_camera_and_the_error(found):
    text = "\n".join(report(found))
    for part in ("cam01: ", "images +4", "seen together: cam01 and cam02 ", "expected error where the board was: "):
        assert part in text
    assert text.startswith("board: charuco, 7 x 9 squares of 60 mm")
    data = report_data(found)
    assert data["floor"] is True
    assert [one["name"] for one in data["cameras"]] == ["cam01", "cam02"]  # type: ignore[attr-defined, index]
