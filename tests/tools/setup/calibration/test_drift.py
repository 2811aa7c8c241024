"""Drift check: a moved camera is named with its new pose, unmoved ones are not."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from tests.support.moving_balls import mask_of, ring
from tests.tools.judge.test_view_lag import messages
from zenocap.common.arrays import Floats
from zenocap.common.camera.pinhole import Camera
from zenocap.common.errors import UserError
from zenocap.common.lags.tangents import Outline, outline_of
from zenocap.tools.setup.calibration.drift import Drift, drift_of, moved_camera
from zenocap.tools.setup.calibration.drift_report import contradicts, corrected, drift_data, drift_lines, take_drift

CAMERAS = ring((0, 70, 150, 250))
TURN, SHIFT = np.radians([0.4, 0.9, -0.3]), np.array([0.05, 0.0, 0.02])
TURNED, SHIFTED = np.concatenate([TURN, np.zeros(3)]), np.concatenate([TURN, SHIFT])


def with_moved(motions: Mapping[str, Floats], cameras: Mapping[str, Camera] = CAMERAS) -> dict[str, Camera]:
    return dict(cameras) | {name: moved_camera(cameras[name], motion) for name, motion in motions.items()}


def instants(cameras: Mapping[str, Camera], calibrated: Mapping[str, Camera], count: int = 60) -> list[dict[str, Outline]]:
    """What `cameras` see, when the calibration says `calibrated`."""
    found = []
    for k in range(count):
        seen = {name: outline_of(calibrated[name], mask_of(camera, 0.25 * k), 0.0) for name, camera in cameras.items()}
        found.append({name: one for name, one in seen.items() if one is not None})
    return found


def found_with(cameras: Mapping[str, Camera], calibrated: Mapping[str, Camera] = CAMERAS) -> Drift:
    return drift_of(calibrated, instants(cameras, calibrated))


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["cam01", "cam03"])
@pytest.mark.parametrize("motion", [TURNED, SHIFTED], ids=["turned", "and shifted"])
def test_a_moved_camera_is_named_with_its_new_pose(name, motion):
    now = with_moved({name: motion})
    found = found_with(now)
    assert [one.name for one in found.moved] == [name]
    one = found.moved[0]
    assert one.after_px < 0.6 < one.before_px
    points = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (0.2, 1.6) for z in (-0.5, 0.5)])
    off = np.linalg.norm(one.camera.project(points) - now[name].project(points), axis=1)
    assert off.max() < 1.5
    assert contradicts(found)
    assert any(f"{name} was moved: turned by " in line for line in drift_lines(found))


@pytest.mark.nightly
def test_two_moved_cameras_are_named():
    found = found_with(with_moved({"cam02": TURNED, "cam04": -TURNED}))
    assert {one.name for one in found.moved} == {"cam02", "cam04"}


@pytest.mark.nightly
def test_unmoved_cameras_are_not_named():
    found = found_with(CAMERAS)
    assert found.moved == ()
    assert not contradicts(found)
    assert drift_lines(found)[-1] == "no camera was moved"
    assert max(found.pairs_px.values()) < 1.0


def test_of_two_cameras_none_is_named():
    two = {name: CAMERAS[name] for name in ("cam01", "cam02")}
    found = found_with(with_moved({"cam01": 3 * TURNED}, two), two)
    assert found.moved == ()
    assert contradicts(found)
    assert "two cameras do not show which one was moved" in drift_lines(found)[-1]


@pytest.mark.nightly
def test_the_corrected_calibration_is_right_at_its_own_size():
    found = found_with(with_moved({"cam03": SHIFTED}))
    large = {name: camera.resized((1280, 960)) for name, camera in CAMERAS.items()}
    written = corrected(found, CAMERAS, large)
    assert written["cam03"].size == (1280, 960)
    np.testing.assert_allclose(written["cam03"].rotation, found.moved[0].camera.rotation, atol=1e-12)
    np.testing.assert_allclose(written["cam03"].centre, found.moved[0].camera.centre, atol=1e-12)
    assert written["cam01"] is large["cam01"]


@pytest.mark.nightly
def test_another_calibration_is_not_corrected():
    now = with_moved({"cam03": SHIFTED})
    found = found_with(now)
    with pytest.raises(UserError, match=r"cam03: the calibration has it turned by 1\.03 degrees and .* mm away"):
        corrected(found, CAMERAS, now)
    with pytest.raises(UserError, match="no camera 'cam04', which is in the take; there are: cam01, cam02, cam03"):
        corrected(found, CAMERAS, {name: CAMERAS[name] for name in ("cam01", "cam02", "cam03")})


@pytest.mark.nightly
def test_a_camera_that_cannot_be_compared_is_named_and_is_not_called_unmoved():
    seen_by_all = instants(CAMERAS, CAMERAS)
    rarely = [{name: one for name, one in seen.items() if name != "cam02" or k < 5} for k, seen in enumerate(seen_by_all)]
    found = drift_of(CAMERAS, rarely)
    assert found.unchecked == ("cam02",)
    assert contradicts(found)
    assert any("not checked: cam02" in line for line in drift_lines(found))
    hidden = [{name: replace(one, cut=np.ones_like(one.cut)) for name, one in seen.items()} for seen in seen_by_all]
    with pytest.raises(ValueError, match="no two cameras show the person whole"):
        drift_of(CAMERAS, hidden)


def test_few_instants_are_refused():
    with pytest.raises(ValueError, match="seen by two cameras in 5 frame sets: allowed: 12 or more"):
        drift_of(CAMERAS, instants(CAMERAS, CAMERAS, 5))


@pytest.mark.slow
def test_takes_are_checked_and_short_ones_refused(tmp_path):
    seen = messages({"cam01": 0.0, "cam02": 0.0, "cam03": 0.0})
    found, cameras = take_drift(tmp_path / "a.mcap", seen)
    assert list(cameras) == ["cam01", "cam02", "cam03"]
    assert found.moved == ()
    assert drift_data(found)["instants"] == found.instants >= 12
    with pytest.raises(UserError, match=r"a\.mcap: the person is seen by two cameras in .* film a person who walks"):
        take_drift(tmp_path / "a.mcap", seen[: len(seen) // 4])
    with pytest.raises(UserError, match=r"a\.mcap: 0 camera\(s\): allowed: a take of two or more"):
        take_drift(tmp_path / "a.mcap", [])
