"""The whole calibration of upright bodies without limbs, and of one simulated walker."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.cases.calibration.walk import errors, simulated
from tests.support.simulated_cameras import look
from tests.support.stored import stored
from tests.support.upright import HEIGHT_M, figure, hulls_seen
from zenocap.common.errors import UserError
from zenocap.tools.setup.calibration.walk.calibration import apart_m, calibrated_walk
from zenocap.tools.setup.calibration.walk.report import report, report_data, verdict

PLACES = {"cam01": (0.3, 1.4, 5.0), "cam02": (4.6, 2.2, -1.5), "cam03": (-4.2, 1.1, -2.0)}
CAMERAS = {name: look(name, np.array(place), np.array([0.0, 0.9, 0.0]), 0.03) for name, place in PLACES.items()}


def found_with(path, cameras=CAMERAS, **changes):
    hulls = {name: hulls_seen(camera, path) for name, camera in cameras.items()}
    unknown = {name: replace(one, rotation=np.eye(3), translation=np.zeros(3)) for name, one in cameras.items()}
    return calibrated_walk(unknown, hulls | changes, HEIGHT_M)


@pytest.fixture(scope="module")
def good():
    return stored(
        lambda: found_with(figure()), "walk", sources=(__name__, "zenocap.tools.setup.calibration.walk.calibration")
    )


@pytest.mark.nightly
def test_three_cameras_are_found(good):
    found = errors(good, CAMERAS)
    assert found["rotation"] < 0.5
    assert found["vertical"] < 0.5
    assert found["scale"] < 5.0  # bodies without feet: these are not nearer to the camera than the head
    assert found["place"] < 250.0
    assert verdict(good)[0] == "good", report(good)


@pytest.mark.nightly
def test_the_world_has_its_origin_in_the_walk_and_the_first_camera_on_z(good):
    first = good.cameras[0].camera
    assert first.name == "cam01"
    assert abs(first.centre[0]) < 1e-6
    assert first.centre[2] > 4.0
    assert first.centre[1] == pytest.approx(1.4, abs=0.1)


@pytest.mark.nightly
def test_the_report_names_every_camera(good):
    text = "\n".join(report(good))
    assert all(name in text for name in CAMERAS)
    assert "mrad" in text
    assert report_data(good)["verdict"] == "good"


@pytest.mark.nightly
def test_a_straight_walk_is_poor():
    found = found_with(figure(width_m=0.02))
    word, reasons = verdict(found)
    assert word == "poor"
    assert any("in curves" in reason for reason in reasons)


@pytest.mark.nightly
def test_a_person_in_one_place_is_refused():
    with pytest.raises(UserError, match="moves less than a metre"):
        found_with(0.05 * figure())


def cut(hulls):
    return replace(hulls, cut=np.ones_like(hulls.cut))


def mirrored(hulls):
    return replace(hulls, local=hulls.local * [-1.0, 1.0, 1.0])


@pytest.mark.parametrize(
    ("name", "change", "shift", "message"),
    [
        pytest.param("cam02", cut, 0, "cam02: the person is whole in 0", marks=pytest.mark.slow),
        pytest.param("cam03", mirrored, 0, "cam03: the image is mirrored", marks=pytest.mark.nightly),
        pytest.param("cam02", lambda hulls: hulls, 20, "cam02: its way .* in step", marks=pytest.mark.slow),
    ],
    ids=["cut", "mirrored", "out of step"],
)
def test_a_camera_that_cannot_be_used_is_named(name, change, shift, message):
    hulls = change(hulls_seen(CAMERAS[name], np.roll(figure(), shift, axis=0)))
    with pytest.raises(UserError, match=message):
        found_with(figure(), **{name: hulls})


def test_places_seen_by_the_same_cameras_are_not_apart():
    points = np.random.default_rng(0).normal(size=(10, 3))
    by = np.array([0.5, 0.0, 1.0])
    moved = {name: replace(one, translation=one.translation - one.rotation @ by) for name, one in CAMERAS.items()}
    assert apart_m(CAMERAS, moved, points + by).max() < 1e-6
    larger = {name: replace(one, translation=1.1 * one.translation) for name, one in CAMERAS.items()}
    assert apart_m(larger, CAMERAS, points).max() > 0.05


@pytest.mark.slow
def test_a_simulated_walker_calibrates_two_cameras():
    found, true = simulated(20, 2, 6.0)
    off = errors(found, true)
    assert off["rotation"] < 0.8
    assert off["scale"] < 2.5
    assert off["vertical"] < 0.8
    assert off["error"] < 2.0 * off["claimed"]
    assert off["worst camera"] < 15.0
