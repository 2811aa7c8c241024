"""Adaptive background with the tracker's pose: a still person is held, a wrong pose is not."""

import numpy as np
import pytest

from tests.common.vision.test_adaptive import FPS, HEIGHT, LEARNT, OPTIONS, WIDTH, overlap, person, picture, walk
from tests.common.vision.test_background import room
from zenocap.common.arrays import Floats, Mask
from zenocap.common.vision.adaptive.follow import follow
from zenocap.common.vision.adaptive.judgement import EXPLAINED_HOLD_S
from zenocap.common.vision.adaptive.model import start
from zenocap.common.vision.prediction import Prediction, depths
from zenocap.common.vision.silhouette import Extents, describe

SHORT_HOLD_S = 90.0


def expected(mask: Mask) -> Prediction:
    found = describe(mask)
    assert found is not None
    return Prediction(0, 0, depths(mask), 3.0, Extents(*found.extents))


class Fed:
    """Frames through the model, with a prediction for each."""

    def __init__(self, scene: Floats) -> None:
        self.model, self.frame = start([picture(scene, None, k) for k in range(LEARNT)]), LEARNT

    def overlap(self, scene: Floats, mask: Mask | None, prediction: Prediction | None) -> float:
        image = picture(scene, mask, self.frame)
        self.model, silhouette = follow(self.model, image, self.frame / FPS, OPTIONS, prediction=prediction)
        self.frame += 1
        if mask is None:
            return 0.0 if silhouette is None else 1.0
        return 0.0 if silhouette is None else overlap(silhouette.mask, mask)


def walked() -> tuple[Floats, Fed]:
    scene = room(HEIGHT, WIDTH)
    fed = Fed(scene)
    for mask in walk(4.0):
        fed.overlap(scene, mask, expected(mask))
    return scene, fed


@pytest.mark.nightly
def test_a_figure_that_never_moves_is_held_beyond_a_minute_where_the_pose_explains_it() -> None:
    scene, fed = walked()
    found = [fed.overlap(scene, person(60), expected(person(60))) for _ in range(75 * FPS)]
    assert min(found) > 0.85
    assert EXPLAINED_HOLD_S > 75.0


@pytest.mark.nightly
def test_furniture_that_touches_the_person_is_dropped_and_learnt() -> None:
    scene, fed = walked()
    after = scene.copy()
    after[60:90, 74:110] = (60, 90, 140)
    found = [fed.overlap(after, person(60), expected(person(60))) for _ in range(10 * FPS)]
    assert min(found[3 * FPS :]) > 0.85
    assert np.abs(fed.model.background.mean - after)[65:85, 85:105].max() < 10


@pytest.mark.slow
def test_a_pose_where_nothing_differs_makes_no_silhouette_and_holds_no_ghost() -> None:
    scene, fed = walked()
    found = [fed.overlap(scene, None, expected(person(60))) for _ in range(3 * FPS)]
    assert sum(found[2:]) == 0.0


@pytest.mark.nightly
def test_a_pose_that_is_stuck_leaves_the_silhouette_of_the_person_who_walks_on() -> None:
    scene, fed = walked()
    stuck = expected(person(60))
    found = [fed.overlap(scene, mask, stuck) for mask in walk(10.0, 60)]
    assert np.mean(np.array(found) > 0.8) > 0.9
