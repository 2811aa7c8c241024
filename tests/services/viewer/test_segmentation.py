"""Background models of a viewer: noise of compression raises limits."""

from collections.abc import Sequence

import cv2
import numpy as np

from tests.common.vision.test_adaptive import ROOM, person, picture
from tests.support.simulated_cameras import look
from zenocap.common.arrays import Image
from zenocap.common.rig.sources import FirstFrames
from zenocap.common.vision.background import Background
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.parameters import UPDATE_EVERY
from zenocap.services.viewer.segmentation import learn as learnt_by
from zenocap.services.viewer.segmentation import segment
from zenocap.services.viewer.states import LearningBackground, Segmentation, ViewerSetup

EMPTY = 20
SETUP = ViewerSetup("1", look("1", np.array([0.0, 1.0, 4.0]), np.zeros(3)), FirstFrames(EMPTY))


def learnt(images: Sequence[Image]) -> Segmentation:
    state, scene = LearningBackground(), None
    for image in images:
        state, scene = learnt_by(SETUP, state, image)
    assert scene is not None
    return scene


def test_the_noise_of_compression_around_a_person_raises_the_limits_of_a_small_learnt_background_too() -> None:
    halos = []
    for around, larger in ((0.0, 1), (6.0, 1), (6.0, 2)):
        scene = learnt([np.kron(picture(ROOM, None, k), np.ones((larger, larger, 1), np.uint8)) for k in range(EMPTY)])
        for k in range(10):
            mask = person(20 + 8 * k)
            near = cv2.dilate(mask, np.ones((17, 17), np.uint8))[..., None]
            coded = picture(ROOM, mask, k) + near * np.random.default_rng(k).normal(0.0, around, ROOM.shape)
            image = np.kron(np.clip(coded, 0, 255), np.ones((larger, larger, 1))).astype(np.uint8)
            scene, _, _ = segment(SETUP, scene, Frame(UPDATE_EVERY * k, k * 10**8, image))
        assert isinstance(scene.background, Background)
        halos.append(scene.background.halo)
    assert halos[0] < 1.1 < 2.7 < halos[1]
    assert halos[2] == 1.0
