"""A live camera: newest images, measures, failures."""

import numpy as np
import pytest

from tests.support.live_cameras import at_once, camera_of, paced, picture, running, until
from zenocap.common.errors import OpenError
from zenocap.tools.setup.page import camera as module
from zenocap.tools.setup.page.camera import LiveCamera, stop_all


@pytest.mark.slow
def test_the_newest_image_and_those_before_it_are_kept():
    camera = camera_of(lambda: at_once(picture, 40))
    with running(camera):
        until(lambda: camera.looks == 40, "40 images")
        assert camera.newest.frame == 39
        kept = [frame.frame for frame in camera.recent]
        assert kept == list(range(kept[0], 40))
        assert 12 <= len(kept) <= 15  # 0.45 s at 30 frames/s
        assert camera.problem == ""


@pytest.mark.slow
def test_measures_of_the_images():
    camera = camera_of(lambda: at_once(lambda k: picture(k, noise=4.0), 120))
    with running(camera):
        until(lambda: camera.looks == 120, "120 images")
        found = camera.measures()
    assert found.noise == pytest.approx(4.0 / np.sqrt(3), rel=0.3)  # of the grey image: three channels, unequal weights
    assert found.sharpness == 1.0
    assert found.light is not None


@pytest.mark.slow
def test_measuring_anew_forgets_the_best_focus():
    blurred = []
    camera = camera_of(lambda: paced(lambda k: np.full((64, 96, 3), 120, np.uint8) if blurred else picture(k)))
    with running(camera):
        until(lambda: camera.looks > 3, "images")
        camera.measures()
        blurred.append(True)
        looks = camera.looks
        until(lambda: camera.looks > looks + 4, "further images")
        assert camera.measures().sharpness < 0.1
        camera.measure_anew()
        assert camera.measures().sharpness in (None, 1.0)  # of a plain image 0 of 0


def test_a_camera_that_does_not_open_is_tried_again(monkeypatch):
    monkeypatch.setattr(module, "RETRY_S", 0.01)
    monkeypatch.setattr(module.LiveCamera, "_is_missing", lambda self: False)
    failures = []

    def opened():
        if len(failures) < 2:
            failures.append(OpenError("camera 0: delivers no image"))
            raise failures[-1]
        yield from at_once(picture, 5)

    camera = camera_of(opened)
    with running(camera):
        until(lambda: camera.newest is not None, "images of the third try")
        assert len(failures) == 2
        assert camera.problem == ""


def test_a_bug_of_a_source_is_shown_instead_of_ending_the_page():
    def broken():
        raise RuntimeError("driver")
        yield

    camera = camera_of(broken)
    with running(camera):
        until(lambda: camera.failure is not None, "the failure")
        assert camera.problem == "left: driver"


@pytest.mark.slow
def test_another_size_begins_anew():
    camera = camera_of(lambda: at_once(lambda k: picture(k, size=(96, 64) if k < 5 else (160, 120)), 8))
    with running(camera):
        until(lambda: camera.looks == 8, "8 images")
        assert {frame.image.shape for frame in camera.recent} == {(120, 160, 3)}


def test_all_cameras_begin_to_close_before_one_is_waited_for(monkeypatch):
    asked = []
    monkeypatch.setattr(LiveCamera, "stop", lambda self, wait_s: asked.append((self.name, wait_s > 0)))
    stop_all([camera_of(lambda: iter(()), name) for name in ("left", "right")])
    assert asked == [("left", False), ("right", False), ("left", True), ("right", True)]
