"""Adaptive background: people from the first frame, light, furniture, standing, compression."""

from collections.abc import Iterator

import cv2
import numpy as np
import pytest

from tests.common.vision.test_background import room, shot
from zenocap.common.arrays import Floats, Image, Mask
from zenocap.common.vision.adaptive.follow import follow
from zenocap.common.vision.adaptive.model import Adaptive, start
from zenocap.common.vision.silhouette import SilhouetteOptions

FPS, LEARNT = 15, 30
HEIGHT, WIDTH = 120, 160
OPTIONS = SilhouetteOptions(choice="nearest")


def person(left: int) -> Mask:
    """A figure of 14 x 64 px with its left side at a column."""
    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    mask[30:94, left : left + 14] = 1
    mask[24:32, left + 4 : left + 10] = 1
    return mask


def walking(frame: int) -> int:
    """Column of a person who walks to and fro."""
    return 70 + round(50 * np.sin(frame / 25))


def picture(scene: Floats, mask: Mask | None, frame: int) -> Image:
    painted = scene.copy()
    if mask is not None:
        rows = np.arange(HEIGHT)[:, None, None]
        colours = np.where(rows < 60, np.array([40.0, 60.0, 190.0]), np.array([70.0, 30.0, 20.0]))
        painted = np.where(mask[..., None] != 0, colours, painted)
    return shot(painted, frame)


def overlap(a: Mask, b: Mask) -> float:
    return np.count_nonzero(a & b) / max(1, np.count_nonzero(a | b))


class Camera:
    """Frames through the model.  The person is nowhere while the model learns unless `at` is given."""

    def __init__(self, scene: Floats, at: int | None = None, around: float = 0.0) -> None:
        seen, self._around = None if at is None else person(at), around
        self.model: Adaptive = start([picture(scene, seen, k) for k in range(LEARNT)])
        self.frame = LEARNT

    def _coded(self, image: Image, mask: Mask) -> Image:
        """The image with more noise within 8 px of the person, as compression leaves it."""
        near = cv2.dilate(mask, np.ones((17, 17), np.uint8))[..., None]
        noise = np.random.default_rng(self.frame).normal(0.0, self._around, image.shape)
        return np.clip(image + noise * near, 0, 255).astype(np.uint8)

    def overlaps(self, scene: Floats, masks: Iterator[Mask]) -> list[float]:
        """Overlap of the silhouette with each true mask."""
        found = []
        for mask in masks:
            image = self._coded(picture(scene, mask, self.frame), mask)
            self.model, silhouette = follow(self.model, image, self.frame / FPS, OPTIONS)
            found.append(0.0 if silhouette is None else overlap(silhouette.mask, mask))
            self.frame += 1
        return found


def walk(seconds: float, first: int = 0) -> Iterator[Mask]:
    return (person(walking(first + k)) for k in range(round(seconds * FPS)))


@pytest.mark.nightly
def test_a_person_who_was_there_from_the_start_is_uncovered() -> None:
    scene = room(HEIGHT, WIDTH)
    camera = Camera(scene, at=70)
    found = camera.overlaps(scene, walk(12.0))
    assert min(found[6 * FPS :]) > 0.85
    assert np.abs(camera.model.background.mean - scene)[40:80, 70:84].max() < 8  # the place of the person is the room again


@pytest.mark.slow
def test_a_lamp_that_is_switched_off_is_followed_at_once() -> None:
    scene = room(HEIGHT, WIDTH)
    camera = Camera(scene)
    assert min(camera.overlaps(scene, walk(3.0))[2:]) > 0.85
    dark = scene * np.linspace(1.0, 0.6, WIDTH)[None, :, None]
    assert min(camera.overlaps(dark, walk(3.0, 45))) > 0.8


def test_frames_before_the_white_balance_settled_are_brought_to_the_light_of_the_last() -> None:
    scene = room(HEIGHT, WIDTH)
    settled = scene * np.array([0.85, 1.0, 1.2])
    model = start([picture(scene if k < LEARNT // 2 else settled, None, k) for k in range(LEARNT)])
    assert np.abs(model.background.mean - settled).mean() < 1.0
    assert np.median(model.background.sigma()) < 4.0


@pytest.mark.nightly
def test_furniture_that_was_moved_is_taken_up_and_the_person_is_not() -> None:
    scene = room(HEIGHT, WIDTH)
    before, after = scene.copy(), scene.copy()
    before[70:100, 10:40] = (60, 90, 140)
    after[70:100, 130:155] = (60, 90, 140)
    camera = Camera(before)
    camera.overlaps(before, walk(3.0))
    found = camera.overlaps(after, walk(12.0, 45))
    assert np.mean(found[6 * FPS :]) > 0.9
    assert np.abs(camera.model.background.mean - after)[75:95, 15:35].max() < 10


@pytest.mark.nightly
def test_a_person_who_moves_in_place_before_a_thing_of_the_colour_of_the_shirt_is_not_learnt() -> None:
    scene = room(HEIGHT, WIDTH)
    scene[36:42, 62:70] = (40, 60, 190)
    camera = Camera(scene)
    camera.overlaps(scene, walk(3.0))
    moving = (person(60 + round(5 * np.sin(k / 7))) for k in range(20 * FPS))
    assert min(camera.overlaps(scene, moving)[3 * FPS :]) > 0.85
    learnt = np.abs(camera.model.background.mean - scene)[30:90, 60:74].max(axis=2) > 20
    assert np.count_nonzero(learnt) < 40  # of 840 px


@pytest.mark.nightly
def test_a_person_who_stands_and_sways_for_a_minute_stays() -> None:
    scene = room(HEIGHT, WIDTH)
    camera = Camera(scene)
    camera.overlaps(scene, walk(4.0))
    swaying = (person(60 + (k // 12) % 2) for k in range(60 * FPS))
    assert min(camera.overlaps(scene, swaying)) > 0.85


@pytest.mark.nightly
def test_a_figure_that_never_moves_is_held_for_a_minute_and_not_for_ever() -> None:
    scene = room(HEIGHT, WIDTH)
    camera = Camera(scene)
    camera.overlaps(scene, walk(4.0))
    found = camera.overlaps(scene, (person(60) for _ in range(75 * FPS)))
    assert min(found[: 50 * FPS]) > 0.85
    assert found[-1] == 0.0


@pytest.mark.nightly
def test_the_noise_of_compression_around_a_person_raises_the_threshold() -> None:
    scene = room(HEIGHT, WIDTH)
    plain, coded = Camera(scene), Camera(scene, around=5.0)
    plain.overlaps(scene, walk(8.0))
    found = coded.overlaps(scene, walk(8.0))
    assert 1.4 * plain.model.halo < coded.model.halo
    assert np.mean(found[4 * FPS :]) > np.mean(found[: FPS // 2]) + 0.01


def test_a_frame_of_another_size_is_refused() -> None:
    camera = Camera(room(HEIGHT, WIDTH))
    with pytest.raises(ValueError, match=r"frame: shape \(60, 80, 3\); the background's is"):
        follow(camera.model, np.zeros((60, 80, 3), np.uint8), 0.0, OPTIONS)
