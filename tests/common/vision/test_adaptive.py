"""Adaptive background: people, light, furniture, standing, compression; with the tracker's pose."""

from collections.abc import Iterator

import cv2
import numpy as np
import pytest

from tests.common.vision.test_background import room, shot
from zenocap.common.arrays import Floats, Image, Mask
from zenocap.common.vision.adaptive.follow import follow
from zenocap.common.vision.adaptive.judgement import EXPLAINED_HOLD_S
from zenocap.common.vision.adaptive.model import Adaptive, start
from zenocap.common.vision.prediction import Prediction, depths
from zenocap.common.vision.silhouette import SilhouetteOptions, describe

FPS, LEARNT = 15, 30
HEIGHT, WIDTH = 120, 160
ROOM = room(HEIGHT, WIDTH)
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

    def __init__(self, scene: Floats = ROOM, at: int | None = None, around: float = 0.0) -> None:
        seen, self._around = None if at is None else person(at), around
        self.model: Adaptive = start([picture(scene, seen, k) for k in range(LEARNT)])
        self.frame = LEARNT

    def _coded(self, image: Image, mask: Mask) -> Image:
        """The image with more noise within 8 px of the person, as compression leaves it."""
        near = cv2.dilate(mask, np.ones((17, 17), np.uint8))[..., None]
        noise = np.random.default_rng(self.frame).normal(0.0, self._around, image.shape)
        return np.clip(image + noise * near, 0, 255).astype(np.uint8)

    def overlap(self, scene: Floats, mask: Mask, prediction: Prediction | None = None) -> float:
        """Overlap of the silhouette with the true mask."""
        image = self._coded(picture(scene, mask, self.frame), mask)
        self.model, silhouette = follow(self.model, image, self.frame / FPS, OPTIONS, prediction=prediction)
        self.frame += 1
        return 0.0 if silhouette is None else overlap(silhouette.mask, mask)

    def overlaps(self, scene: Floats, masks: Iterator[Mask]) -> list[float]:
        return [self.overlap(scene, mask) for mask in masks]


def walk(seconds: float, first: int = 0) -> Iterator[Mask]:
    return (person(walking(first + k)) for k in range(round(seconds * FPS)))


@pytest.fixture
def walked() -> Camera:
    """A camera before which the person has walked for four seconds."""
    camera = Camera()
    camera.overlaps(ROOM, walk(4.0))
    return camera


@pytest.mark.nightly
def test_a_person_who_was_there_from_the_start_is_uncovered() -> None:
    camera = Camera(at=70)
    found = camera.overlaps(ROOM, walk(12.0))
    assert min(found[6 * FPS :]) > 0.85
    assert np.abs(camera.model.background.mean - ROOM)[40:80, 70:84].max() < 8  # the place of the person is the room again


@pytest.mark.slow
def test_a_lamp_that_is_switched_off_is_followed_at_once() -> None:
    camera = Camera()
    assert min(camera.overlaps(ROOM, walk(3.0))[2:]) > 0.85
    dark = ROOM * np.linspace(1.0, 0.6, WIDTH)[None, :, None]
    assert min(camera.overlaps(dark, walk(3.0, 45))) > 0.8


def test_frames_before_the_white_balance_settled_are_brought_to_the_light_of_the_last() -> None:
    settled = ROOM * np.array([0.85, 1.0, 1.2])
    model = start([picture(ROOM if k < LEARNT // 2 else settled, None, k) for k in range(LEARNT)])
    assert np.abs(model.background.mean - settled).mean() < 1.0
    assert np.median(model.background.sigma()) < 4.0


@pytest.mark.nightly
def test_furniture_that_was_moved_is_taken_up_and_the_person_is_not() -> None:
    before, after = ROOM.copy(), ROOM.copy()
    before[70:100, 10:40] = (60, 90, 140)
    after[70:100, 130:155] = (60, 90, 140)
    camera = Camera(before)
    camera.overlaps(before, walk(3.0))
    found = camera.overlaps(after, walk(12.0, 45))
    assert np.mean(found[6 * FPS :]) > 0.9
    assert np.abs(camera.model.background.mean - after)[75:95, 15:35].max() < 10


@pytest.mark.nightly
def test_a_person_who_moves_in_place_before_a_thing_of_the_colour_of_the_shirt_is_not_learnt() -> None:
    scene = ROOM.copy()
    scene[36:42, 62:70] = (40, 60, 190)
    camera = Camera(scene)
    camera.overlaps(scene, walk(3.0))
    moving = (person(60 + round(5 * np.sin(k / 7))) for k in range(20 * FPS))
    assert min(camera.overlaps(scene, moving)[3 * FPS :]) > 0.85
    learnt = np.abs(camera.model.background.mean - scene)[30:90, 60:74].max(axis=2) > 20
    assert np.count_nonzero(learnt) < 40  # of 840 px


@pytest.mark.nightly
def test_a_person_who_stands_and_sways_for_a_minute_stays(walked: Camera) -> None:
    swaying = (person(60 + (k // 12) % 2) for k in range(60 * FPS))
    assert min(walked.overlaps(ROOM, swaying)) > 0.85


@pytest.mark.nightly
def test_a_figure_that_never_moves_is_held_for_a_minute_and_not_for_ever(walked: Camera) -> None:
    found = walked.overlaps(ROOM, (person(60) for _ in range(75 * FPS)))
    assert min(found[: 50 * FPS]) > 0.85
    assert found[-1] == 0.0


@pytest.mark.nightly
def test_the_noise_of_compression_around_a_person_raises_the_threshold() -> None:
    plain, coded = Camera(), Camera(around=5.0)
    plain.overlaps(ROOM, walk(8.0))
    found = coded.overlaps(ROOM, walk(8.0))
    assert 1.4 * plain.model.background.halo < coded.model.background.halo
    assert min(found) > 0.98


def test_a_frame_of_another_size_is_refused() -> None:
    with pytest.raises(ValueError, match=r"frame: shape \(60, 80, 3\); the background's is"):
        follow(Camera().model, np.zeros((60, 80, 3), np.uint8), 0.0, OPTIONS)


def expected(mask: Mask) -> Prediction:
    """Prediction of a pose whose image is this mask."""
    return Prediction(0, 0, depths(mask), 3.0, describe(mask).extents)


@pytest.fixture
def predicted() -> Camera:
    """As `walked`, with the tracker's pose for each frame."""
    camera = Camera()
    for mask in walk(4.0):
        camera.overlap(ROOM, mask, expected(mask))
    return camera


@pytest.mark.nightly
def test_a_figure_that_never_moves_is_held_beyond_a_minute_where_the_pose_explains_it(predicted: Camera) -> None:
    found = [predicted.overlap(ROOM, person(60), expected(person(60))) for _ in range(75 * FPS)]
    assert min(found) > 0.85
    assert EXPLAINED_HOLD_S > 75.0


@pytest.mark.nightly
def test_furniture_that_touches_the_person_is_dropped_and_learnt_with_a_pose(predicted: Camera) -> None:
    after = ROOM.copy()
    after[60:90, 74:110] = (60, 90, 140)
    found = [predicted.overlap(after, person(60), expected(person(60))) for _ in range(10 * FPS)]
    assert min(found[3 * FPS :]) > 0.85
    assert np.abs(predicted.model.background.mean - after)[65:85, 85:105].max() < 10


@pytest.mark.slow
def test_a_pose_where_nothing_differs_makes_no_silhouette_and_holds_no_ghost(predicted: Camera) -> None:
    for k in range(3 * FPS):
        image = picture(ROOM, None, predicted.frame + k)
        time_s = (predicted.frame + k) / FPS
        predicted.model, silhouette = follow(predicted.model, image, time_s, OPTIONS, prediction=expected(person(60)))
        assert silhouette is None or k < 2


@pytest.mark.nightly
def test_a_pose_that_is_stuck_leaves_the_silhouette_of_the_person_who_walks_on(predicted: Camera) -> None:
    found = [predicted.overlap(ROOM, mask, expected(person(60))) for mask in walk(10.0, 60)]
    assert np.mean(np.array(found) > 0.8) > 0.9
