"""The silhouette of a person in a synthetic room, and in the shared clips if present."""

import tomllib
from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest

from tests.common.vision.test_adaptive import overlap
from tests.support.places import CLIPS
from zenocap.common.arrays import Image, Mask
from zenocap.common.vision.background import Background, learn
from zenocap.common.vision.extraction import clean, extract
from zenocap.common.vision.foreground import BACKGROUND, STRONG, UNSURE
from zenocap.common.vision.mixture import Mixture
from zenocap.common.vision.silhouette import Extents, SilhouetteOptions, describe

OPTIONS = SilhouetteOptions()
SMALL = (160, 120)
SIZES = [SMALL, (640, 480)]
Scene = np.ndarray[tuple[int, ...], np.dtype[np.float32]]


def room(size: tuple[int, int]) -> Scene:
    width, height = size
    coarse = np.random.default_rng(2).uniform(90, 190, (20, 27, 3)).astype(np.float32)
    coarse = coarse.mean(axis=2, keepdims=True) + 0.1 * (coarse - coarse.mean(axis=2, keepdims=True))
    return np.asarray(cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC), dtype=np.float32)


def body(size: tuple[int, int], dx: int = 0) -> Mask:
    """Arms stretched, legs apart, arms two pixels thin at 160x120."""
    width, height = size
    mask = np.zeros((height, width), dtype=np.uint8)
    u = height / 120
    for left, top, across, down in ((-6, 35, 12, 32), (-3, 25, 6, 10), (-26, 38, 52, 2), (-6, 67, 4, 28), (2, 67, 4, 28)):
        x = round(u * (80 + left)) + dx
        mask[round(u * top) : round(u * (top + down)), max(0, x) : max(0, x + round(u * across))] = 1
    return mask


def ground_shadow(size: tuple[int, int]) -> Mask:
    width, height = size
    mask, u = np.zeros((height, width), dtype=np.uint8), height / 120
    cv2.ellipse(mask, (round(94 * u), round(93 * u)), (round(22 * u), round(5 * u)), 0, 0, 360, 1, -1)
    return mask


def shot(scene: Scene, seed: int, light: float = 1.0) -> Image:
    noise = np.random.default_rng(seed).normal(0, 2, scene.shape)
    return np.clip(np.rint(light * scene + noise), 0, 255).astype(np.uint8)


def with_person(size: tuple[int, int], dx: int = 0) -> Scene:
    softness = 0.35 * cv2.GaussianBlur(ground_shadow(size).astype(np.float32), (0, 0), size[1] / 120)
    scene = room(size) * (1 - softness[..., None])
    mask = body(size, dx)
    y = np.arange(size[1])[:, None, None] / size[1]
    clothes = np.where(y < 0.3, (90, 120, 190), np.where(y < 0.56, (150, 60, 50), (50, 52, 55)))
    return np.asarray(np.where(mask[..., None] > 0, clothes, scene), dtype=np.float32)


@cache
def learned_background(size: tuple[int, int] = SMALL) -> Background:
    return learn([shot(room(size), k) for k in range(25)])


@pytest.mark.nightly
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("light", [1.0, 0.9, 1.08])
def test_the_silhouette_has_the_whole_person_without_shadow_and_gap_between_the_legs(
    size: tuple[int, int], light: float
) -> None:
    found = extract(learned_background(size), shot(with_person(size), 99, light), OPTIONS)
    assert overlap(found.mask, body(size)) > 0.96
    bare = (ground_shadow(size) > 0) & (body(size) == 0)
    assert np.count_nonzero(found.mask[bare]) < 0.05 * np.count_nonzero(bare)
    u = size[1] // 120
    assert np.allclose(found.extents, (54 * u, 106 * u - 1, 25 * u, 95 * u - 1), atol=u)
    assert not found.mask[72 * u : 86 * u, 79 * u : 81 * u].any()


@pytest.mark.nightly
@pytest.mark.parametrize("size", SIZES)
def test_an_empty_scene_has_no_silhouette(size: tuple[int, int]) -> None:
    background = learned_background(size)
    assert all(extract(background, shot(room(size), 50 + k, 1 - 0.02 * k), OPTIONS) is None for k in range(5))


def test_a_person_partly_outside_the_image_is_found_up_to_the_border() -> None:
    found = extract(learned_background(), shot(with_person(SMALL, -60), 99), OPTIONS)
    assert found.extents.leftmost == 0


def test_extraction_is_deterministic_and_does_not_modify_its_inputs() -> None:
    background, frame = learned_background(), shot(with_person(SMALL), 99)
    kept = frame.copy(), background.mean.copy()
    first, second = (extract(background, frame, OPTIONS) for _ in range(2))
    np.testing.assert_array_equal(first.mask, second.mask)
    np.testing.assert_array_equal(frame, kept[0])
    np.testing.assert_array_equal(background.mean, kept[1])


def _labels(*boxes: tuple[int, int, int, int]) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    labels = np.full((120, 160), BACKGROUND, dtype=np.uint8)
    for left, top, across, down in boxes:
        labels[top : top + down, left : left + across] = STRONG
    return labels


TWO = [(20, 30, 12, 60), (110, 40, 10, 50)]  # left, top, width, height of the labelled regions
CHOICES = {
    "largest": (TWO, "largest", None, (20, 31, 30, 89)),
    "nearest": (TWO, "nearest", Extents(108, 117, 40, 89), (110, 119, 40, 89)),
    "nearest to nobody": (TWO, "nearest", None, (20, 31, 30, 89)),
    "too small": ([(20, 30, 12, 60), (60, 50, 7, 7)], "nearest", Extents(60, 66, 50, 56), (20, 31, 30, 89)),
    "separate head": ([(60, 40, 12, 60), (62, 28, 8, 9), (100, 40, 8, 10)], "largest", None, (60, 71, 28, 99)),
}


@pytest.mark.parametrize(("boxes", "choice", "last", "extents"), CHOICES.values(), ids=CHOICES)
def test_the_person_is_the_largest_or_nearest_region_with_what_is_close_to_it(
    boxes: list[tuple[int, int, int, int]], choice: str, last: Extents | None, extents: tuple[int, int, int, int]
) -> None:
    assert clean(_labels(*boxes), replace(OPTIONS, choice=choice), last).extents == extents


def test_a_shadow_alone_has_no_silhouette() -> None:
    labels = _labels()
    labels[90:100, 40:120] = UNSURE
    assert clean(labels, OPTIONS) is None


def test_describe_gives_inclusive_extents() -> None:
    mask = np.zeros((10, 12), dtype=np.uint8)
    mask[2:5, 3:9] = 1
    found = describe(mask)
    assert (found.extents, found.area) == ((3, 8, 2, 4), 18)
    assert found.extents.centre() == (5.5, 3.0)
    assert describe(np.zeros((10, 12), dtype=np.uint8)) is None
    assert describe(mask, 0.2) is None


def test_error_names_the_option_out_of_range() -> None:
    with pytest.raises(ValueError, match=r"join: 1\.5; allowed 0 <= join < 1"):
        SilhouetteOptions(join=1.5)


def test_the_mixture_model_finds_the_person_and_is_deterministic() -> None:
    frames = [shot(room(SMALL), k) for k in range(25)]
    first, second = Mixture(frames), Mixture(frames)
    frame = shot(with_person(SMALL), 99)
    found, again = extract(first, frame, OPTIONS), extract(second, frame, OPTIONS)
    assert overlap(found.mask, body(SMALL)) > 0.85
    assert np.array_equal(found.mask, again.mask)
    with pytest.raises(ValueError, match="the background's is"):
        first.foreground(frame[:50])


@pytest.mark.slow
@pytest.mark.clips
@pytest.mark.parametrize("name", ["walk2", "bend2", "kick2"])
@pytest.mark.parametrize("size", SIZES)
def test_clips_show_one_whole_person_after_the_empty_frames(name: str, size: tuple[int, int]) -> None:
    folder = CLIPS / name
    empty = tomllib.loads((folder / "clip.toml").read_text())["empty_frames"]
    video = cv2.VideoCapture(str(folder / "videos" / "cam01.mp4"))
    frames: list[Image] = []
    while len(frames) < empty + 40:
        seen, frame = video.read()
        assert seen
        frames.append(np.asarray(cv2.resize(frame, size, interpolation=cv2.INTER_AREA), dtype=np.uint8))
    background = learn(frames[:empty])
    assert all(extract(background, frame, OPTIONS) is None for frame in frames[:empty:6])
    found = extract(background, frames[empty + 30], OPTIONS)
    left, right, top, bottom = found.extents
    assert 0.8 < (right - left) / (bottom - top) < 1.2  # arms stretched: as wide as tall, and no shadow beside it
    assert cv2.connectedComponents(found.mask)[0] - 1 <= 3
