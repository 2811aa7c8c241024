"""Foreground labels: noise is background, shadows are not the person, dark clothes are."""

import numpy as np
import pytest

from zenocap.common.arrays import Image, Labels
from zenocap.common.vision.background import Background, learn
from zenocap.common.vision.foreground import BACKGROUND, SHADOW, STRONG, UNSURE, WEAK, ForegroundOptions, foreground

Scene = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
PLACE = np.s_[20:40, 30:60]


def wall(texture: float) -> Scene:
    spots = np.random.default_rng(5).normal(0, texture, (60, 90, 1))
    return np.asarray(np.clip(140 + spots + np.array([0, 4, 8]), 0, 255))


def shot(scene: Scene, seed: int) -> Image:
    return np.clip(np.rint(scene + np.random.default_rng(seed).normal(0, 1.5, scene.shape)), 0, 255).astype(np.uint8)


def learned_background(scene: Scene) -> Background:
    return learn([shot(scene, k) for k in range(25)])


def dimmed(texture: float, share: float) -> Scene:
    """The wall with one place in a share of its light."""
    scene = wall(texture)
    scene[PLACE] *= share
    return scene


def labelled(background: Background, frame: Image, options: ForegroundOptions | None = None) -> Labels:
    return foreground(background, frame, options or ForegroundOptions())[0]


def test_the_empty_scene_is_background() -> None:
    labels = labelled(learned_background(wall(15)), shot(wall(15), 99))
    assert np.mean(labels != BACKGROUND) < 0.001


def test_flicker_is_background_only_when_it_is_measured() -> None:
    background, frame = learned_background(wall(15)), shot(wall(15) * 0.85, 99)
    assert np.mean(labelled(background, frame) != BACKGROUND) < 0.001
    assert np.mean(labelled(background, frame, ForegroundOptions(flicker=False)) != BACKGROUND) > 0.9


def test_another_colour_is_labelled_strong() -> None:
    scene = wall(15)
    scene[PLACE] = (60, 60, 160)
    labels = labelled(learned_background(wall(15)), shot(scene, 99))
    assert np.all(labels[PLACE] == STRONG)
    labels[PLACE] = BACKGROUND
    assert np.mean(labels != BACKGROUND) < 0.001


@pytest.mark.parametrize("dimming", [0.5, 0.7, 0.85])
def test_a_shadow_on_texture_is_labelled_shadow(dimming: float) -> None:
    labels = labelled(learned_background(wall(12)), shot(dimmed(12, dimming), 99))[PLACE]
    assert np.mean(labels == SHADOW) > 0.8
    assert np.mean(labels >= WEAK) < 0.02


def test_a_soft_shadow_on_texture_is_not_foreground() -> None:
    across = np.abs(np.linspace(-1, 1, 60))[:, None, None]
    scene = wall(12) * np.clip(0.5 + across, 0, 1)
    labels = labelled(learned_background(wall(12)), shot(scene, 99), ForegroundOptions(flicker=False))
    assert np.mean(labels >= WEAK) < 0.05


@pytest.mark.parametrize("dimming", [0.5, 0.7])
def test_dark_grey_clothes_in_front_of_texture_are_foreground(dimming: float) -> None:
    scene = wall(12)
    scene[PLACE] = dimming * scene[PLACE].mean(axis=(0, 1))
    labels = labelled(learned_background(wall(12)), shot(scene, 99))[PLACE]
    assert np.mean(labels >= WEAK) > 0.95


def test_without_texture_darkening_is_unsure_and_what_is_darker_than_any_shadow_is_foreground() -> None:
    background = learned_background(wall(0))
    assert np.mean(labelled(background, shot(dimmed(0, 0.65), 99))[PLACE] == UNSURE) > 0.8
    assert np.all(labelled(background, shot(dimmed(0, 0.25), 99))[PLACE] == STRONG)


def test_an_empty_shadow_range_disables_shadow_detection() -> None:
    labels = labelled(learned_background(wall(12)), shot(dimmed(12, 0.7), 99), ForegroundOptions(shadow=(1, 1)))
    assert np.mean(labels[PLACE] == STRONG) > 0.95


def test_a_faint_pixel_beside_a_strong_one_is_background() -> None:
    scene = wall(0)
    scene[PLACE] = (0, 0, 255)
    scene[20:40, 29] += 9
    without_limit = labelled(learned_background(wall(0)), shot(scene, 99), ForegroundOptions(faint=0, weak=2))
    assert np.mean(without_limit[20:40, 29] >= WEAK) > 0.5
    assert not labelled(learned_background(wall(0)), shot(scene, 99), ForegroundOptions(weak=2))[20:40, 29].any()


def test_a_frame_of_another_shape_is_refused() -> None:
    background = learned_background(wall(0))
    with pytest.raises(ValueError, match="the background's is"):
        foreground(background, np.zeros((90, 60, 3), np.uint8), ForegroundOptions())


def test_thresholds_out_of_order_are_refused() -> None:
    with pytest.raises(ValueError, match=r"weak, strong: 9, 5"):
        ForegroundOptions(weak=9, strong=5)
    with pytest.raises(ValueError, match=r"shadow: \(0\.9, 0\.5\)"):
        ForegroundOptions(shadow=(0.9, 0.5))
