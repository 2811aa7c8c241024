"""Foreground labels: noise is background, shadows are not the person, dark clothes are."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from tests.common.vision.test_background import shot
from zenocap.common.arrays import Floats, Labels
from zenocap.common.vision.background import Background, learn
from zenocap.common.vision.foreground import BACKGROUND, SHADOW, STRONG, UNSURE, WEAK, ForegroundOptions, foreground

PLACE = np.s_[20:40, 30:60]


def wall(texture: float) -> Floats:
    spots = np.random.default_rng(5).normal(0, texture, (60, 90, 1))
    return np.asarray(np.clip(140 + spots + np.array([0, 4, 8]), 0, 255))


@cache
def learned_background(texture: float) -> Background:
    return learn([shot(wall(texture), k, 1.5) for k in range(25)])


def labelled(texture: float, scene: Floats, **options: object) -> Labels:
    """Labels of a scene in front of the wall of a texture."""
    return foreground(learned_background(texture), shot(scene, 99, 1.5), ForegroundOptions(**options))[0]


def share(labels: Labels, *of: int) -> float:
    return float(np.mean(np.isin(labels, of)))


def dimmed(light: float) -> Callable[[Floats], Floats]:
    return lambda place: light * place


def grey(light: float) -> Callable[[Floats], Floats]:
    return lambda place: light * place.mean(axis=(0, 1))


@pytest.mark.parametrize(
    ("light", "options", "least"),
    [(1.0, {}, 0.999), (0.85, {}, 0.999), (0.85, {"flicker": False}, 0.0)],
    ids=["empty", "flicker", "flicker that is not measured"],
)
def test_the_empty_scene_is_background(light: float, options: dict[str, object], least: float) -> None:
    background = share(labelled(15, light * wall(15), **options), BACKGROUND)
    assert background >= least
    assert (background < 0.1) == (least == 0.0)


# Texture of the wall, how one place of it looks, options, and shares of labels in that place: at least, at most.
PLACES = {
    "another colour": (15, lambda place: np.array([60, 60, 160]), {}, {(STRONG,): (1.0, 1.0)}),
    "deep shadow": (12, dimmed(0.5), {}, {(SHADOW,): (0.8, 1.0), (WEAK, STRONG): (0.0, 0.02)}),
    "shadow": (12, dimmed(0.7), {}, {(SHADOW,): (0.8, 1.0), (WEAK, STRONG): (0.0, 0.02)}),
    "light shadow": (12, dimmed(0.85), {}, {(SHADOW,): (0.8, 1.0), (WEAK, STRONG): (0.0, 0.02)}),
    "no search for shadows": (12, dimmed(0.7), {"shadow": (1, 1)}, {(STRONG,): (0.95, 1.0)}),
    "dark grey clothes": (12, grey(0.5), {}, {(WEAK, STRONG): (0.95, 1.0)}),
    "grey clothes": (12, grey(0.7), {}, {(WEAK, STRONG): (0.95, 1.0)}),
    "darker without texture": (0, dimmed(0.65), {}, {(UNSURE,): (0.8, 1.0)}),
    "darker than any shadow": (0, dimmed(0.25), {}, {(STRONG,): (1.0, 1.0)}),
}


@pytest.mark.parametrize(("texture", "look", "options", "shares"), PLACES.values(), ids=PLACES)
def test_a_place_that_looks_different_is_labelled(
    texture: float, look: Callable[[Floats], Floats], options: dict[str, object], shares: dict[tuple[int, ...], tuple]
) -> None:
    scene = wall(texture)
    scene[PLACE] = look(scene[PLACE])
    labels = labelled(texture, scene, **options)
    for of, (least, most) in shares.items():
        assert least <= share(labels[PLACE], *of) <= most
    labels[PLACE] = BACKGROUND
    assert share(labels, BACKGROUND) > 0.999


def test_a_soft_shadow_on_texture_is_not_foreground() -> None:
    across = np.abs(np.linspace(-1, 1, 60))[:, None, None]
    assert share(labelled(12, wall(12) * np.clip(0.5 + across, 0, 1), flicker=False), WEAK, STRONG) < 0.05


def test_a_faint_pixel_beside_a_strong_one_is_background() -> None:
    scene = wall(0)
    scene[PLACE] = (0, 0, 255)
    scene[20:40, 29] += 9
    assert share(labelled(0, scene, faint=0, weak=2)[20:40, 29], WEAK, STRONG) > 0.5
    assert not labelled(0, scene, weak=2)[20:40, 29].any()


def test_a_frame_of_another_shape_is_refused() -> None:
    with pytest.raises(ValueError, match="the background's is"):
        foreground(learned_background(0), np.zeros((90, 60, 3), np.uint8), ForegroundOptions())


def test_thresholds_out_of_order_are_refused() -> None:
    with pytest.raises(ValueError, match=r"weak, strong: 9, 5"):
        ForegroundOptions(weak=9, strong=5)
    with pytest.raises(ValueError, match=r"shadow: \(0\.9, 0\.5\)"):
        ForegroundOptions(shadow=(0.9, 0.5))
