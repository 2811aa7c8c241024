"""Camera delays from silhouettes of upright bodies; sync.toml."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.upright import HEIGHT_M, figure, hulls_seen
from tests.tools.setup.calibration.walk.test_calibration import CAMERAS
from zenocap.tools.cli.calibrate.walk import sync_lines
from zenocap.tools.setup.calibration.walk.calibration import calibrated_films
from zenocap.tools.setup.calibration.walk.delays import Delay, SilhouetteSeries, series_of
from zenocap.tools.setup.calibration.walk.report import report, report_data, verdict

FPS, SECONDS = 12.0, 14.0
TIMES = np.arange(0.0, SECONDS, 1.0 / FPS)
TWO = {name: CAMERAS[name] for name in ("cam01", "cam02")}


def places(times):
    """Places (n, 2) of a figure of eight in which the speed changes."""
    path, phase = figure(480), 10.0 * (2.0 * np.pi * times / SECONDS + 0.2 * np.sin(times)) / (2.0 * np.pi)
    at = (48.0 * phase) % 480.0
    wrapped = np.vstack([path, path[:1]])
    return np.column_stack([np.interp(at, np.arange(481), wrapped[:, k]) for k in (0, 1)])


def found_with(late_s):
    series = {
        name: series_of(TIMES, hulls_seen(camera, places(TIMES + (late_s if name == "cam02" else 0.0))))
        for name, camera in TWO.items()
    }
    unknown = {name: replace(one, rotation=np.eye(3), translation=np.zeros(3)) for name, one in TWO.items()}
    return calibrated_films(unknown, SilhouetteSeries(series, np.arange(0.0, SECONDS, 0.2)), HEIGHT_M)


@pytest.mark.nightly
@pytest.mark.parametrize("late_s", [0.25, -0.9])
def test_the_delay_of_a_camera_is_found_to_a_fraction_of_a_frame(late_s):
    found = found_with(late_s)
    assert found.delays["cam02"].seconds == pytest.approx(late_s, abs=0.02)
    assert found.delays["cam02"].is_certain
    assert verdict(found)[0] == "good", report(found)
    assert f"cam02 {1e3 * found.delays['cam02'].seconds:+.0f}" in "\n".join(report(found))
    assert report_data(found)["cameras"][1]["delay_corrected"]


@pytest.mark.nightly
def test_cameras_in_step_stay_and_a_delay_that_is_not_known_or_at_the_limit_of_the_search_is_poor():
    found = found_with(0.0)
    assert not found.delays["cam02"].is_certain
    assert "taken as 0" in "\n".join(report(found))
    for delay, words in ((Delay(0.1, 0.08), "known to 80 ms"), (Delay(-1.6, 0.01), "as far as was searched")):
        poor = replace(found, delays={"cam01": Delay(0.0, 0.0), "cam02": delay})
        assert any(words in reason for reason in verdict(poor)[1])


def test_a_series_is_interpolated_between_images_and_not_over_gaps():
    camera, times = CAMERAS["cam01"], np.array([0.0, 0.1, 0.2, 0.6, 0.7])
    straight = np.column_stack([times, np.zeros(5)])
    series = series_of(times, hulls_seen(camera, straight))
    between = series.at(np.array([0.15, 0.4, 0.9]))
    true = hulls_seen(camera, np.array([[0.15, 0.0]])).local[0]
    for k in (0, 1):
        slopes, theirs = true[:, k] / true[:, 2], between.local[0, :, k] / between.local[0, :, 2]
        assert np.ptp(theirs) == pytest.approx(np.ptp(slopes), rel=0.01)
        assert theirs.max() == pytest.approx(slopes.max(), abs=0.001)
    assert np.isnan(between.local[1:]).all()


def test_sync_toml_is_written_and_not_replaced_unless_wanted(tmp_path):
    assert "written" in sync_lines(tmp_path, {"cam01": 0.0, "cam02": 0.12}, False)[0]
    assert "not written" in sync_lines(tmp_path, {"cam01": 0.0, "cam02": 0.5}, False)[0]
    assert '"cam02" = 0.1200' in (tmp_path / "sync.toml").read_text()
    sync_lines(tmp_path, {"cam01": 0.0, "cam02": 0.5}, True)
    assert '"cam02" = 0.5000' in (tmp_path / "sync.toml").read_text()
