"""Measures of images: each follows what it is named after, and nothing else."""

import cv2
import numpy as np
import pytest

from zenocap.common.vision.image_measures import brightness, exposure, focus, grey_of, light, noise

SIZE = (320, 240)


def scene(seed: int = 0) -> np.ndarray:
    """A textured image (240, 320, 3) as float, levels 60 to 190."""
    coarse = np.random.default_rng(seed).uniform(60, 190, (SIZE[1] // 8, SIZE[0] // 8, 3))
    return cv2.GaussianBlur(np.kron(coarse, np.ones((8, 8, 1))), (0, 0), 0.8)


def image(values: np.ndarray, deviation: float = 0.0, seed: int = 0) -> np.ndarray:
    noisy = values + np.random.default_rng(seed).normal(0, deviation, values.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("seed", range(3))
def test_focus_falls_with_blur_also_in_noise(seed):
    values = scene(seed)
    found = []
    for blur in (0.1, 1.0, 2.0, 4.0):
        soft = cv2.GaussianBlur(values, (0, 0), blur)
        one, other = (grey_of(image(soft, 6.0, k)) for k in (1, 2))
        found.append(focus(other, noise(one, other)))
    assert found[0] > 1.5 * found[1] > 3 * found[2]
    assert found[2] >= found[3]


def test_noise_without_correction_would_hide_the_blur():
    soft = cv2.GaussianBlur(scene(), (0, 0), 6.0)
    one, other = (grey_of(image(soft, 8.0, k)) for k in (1, 2))
    assert focus(other, noise(one, other)) < 0.1 * focus(other, 0.0)


def test_focus_does_not_depend_on_the_exposure():
    values = scene()
    bright, dark = (focus(grey_of(image(gain * values)), 0.0) for gain in (1.2, 0.5))
    assert dark == pytest.approx(bright, rel=0.05)


@pytest.mark.parametrize("deviation", [1.0, 3.0, 10.0])
def test_noise_is_the_standard_deviation_although_something_moves(deviation):
    values = np.full((240, 320), 120.0)
    one, other = image(values, deviation, 1), image(values, deviation, 2)
    assert noise(one, other) == pytest.approx(deviation, rel=0.1, abs=0.1)
    other[:, :120] = image(np.random.default_rng(3).uniform(30, 200, (240, 120)))
    assert noise(one, other) == pytest.approx(deviation, rel=0.15, abs=0.1)


def test_noise_of_a_saturated_image_is_unknown():
    white = np.full((240, 320), 255, dtype=np.uint8)
    assert np.isnan(noise(white, white))
    assert np.isnan(noise(white[:8, :8], white[:8, :8]))


def test_exposure_counts_pixels_at_the_ends_of_the_range():
    values = np.full((100, 100, 3), 120, dtype=np.uint8)
    values[:20, :, 2] = 255  # red alone has lost its detail
    values[80:] = 2
    found = exposure(values)
    assert (found.saturated, found.black) == (pytest.approx(0.2), pytest.approx(0.2))
    assert found.mean == pytest.approx(values.mean())


GRAIN = np.random.default_rng(0).normal(size=(4, SIZE[1], SIZE[0], 3))


def changing(gains, moving=False) -> list[np.ndarray]:
    cells, plain = [], scene()
    for k, gain in enumerate(gains):
        values = np.clip(gain * plain + 3.0 * GRAIN[k % 4], 0, 255).astype(np.uint8)
        if moving:  # a person of a third of the image
            left = 20 + k % 180
            values[60:, left : left + 100] = 30
        cells.append(brightness(values))
    return cells


TIMES = np.arange(150) / 15.0


def test_constant_light_has_neither_drift_nor_flicker_although_a_person_moves():
    found = light(TIMES, changing(np.ones(150), moving=True))
    assert abs(found.drift) < 0.01
    assert found.flicker < 0.008


def test_drift_is_the_change_of_the_brightness_and_no_flicker():
    found = light(TIMES, changing(np.linspace(1.0, 1.15, 150)))
    assert found.drift == pytest.approx(np.log(1.15) * 2 / 3, rel=0.15)  # between the middles of the outer thirds
    assert found.flicker < 0.005


def test_flicker_is_the_deviation_of_fast_changes():
    found = light(TIMES, changing(1.0 + 0.05 * np.sin(2 * np.pi * 4.0 * TIMES)))
    assert found.flicker == pytest.approx(0.05 / np.sqrt(2), rel=0.2)
    assert abs(found.drift) < 0.01


@pytest.mark.slow
def test_stripes_of_a_rolling_shutter_are_flicker():
    rows = np.arange(240)[:, None, None] / 240.0
    gains = [1.0 + 0.05 * np.sin(2 * np.pi * (rows + 4.0 * time)) for time in TIMES]
    assert light(TIMES, changing(gains)).flicker > 0.02


def test_light_needs_time():
    assert light([0.0, 1.0], changing([1.0, 1.0])) is None
