"""People in images of the empty scene: those who enter, leave or stay, and things that move for ever."""

from functools import cache

import numpy as np
import pytest

from tests.support.walkers import walker
from zenocap.common.arrays import Image, Mask
from zenocap.common.vision.background import learn
from zenocap.common.vision.empty_scene import FEWEST_EMPTY, outline_shares, with_people
from zenocap.simulation.rendering.camera import SimulatedCamera

SIZE, COUNT, FPS = (240, 180), 24, 10


@cache
def film() -> tuple[tuple[Image, ...], tuple[Image, ...], tuple[Mask, ...]]:
    """COUNT images of the empty room, as many of a walker in it, and the true silhouettes (height, width) of 0 and 1."""
    scene = walker(3, 2, SIZE)
    camera = SimulatedCamera(scene.cameras["cam01"], scene.person, 3)
    poses = [scene.motion.pose_at(k / FPS) for k in range(COUNT)]
    empty = tuple(camera.render(None, k) for k in range(COUNT))
    masks = tuple(np.asarray(camera.silhouette(pose) != 0, dtype=np.uint8) for pose in poses)
    return empty, tuple(camera.render(pose, COUNT + k) for k, pose in enumerate(poses)), masks


@pytest.mark.parametrize("count", [*range(1, 8), COUNT])
def test_the_empty_scene_has_no_person_in_it(count: int) -> None:
    empty = film()[0][:count]
    assert not with_people(empty).any()
    lit = [np.clip(np.rint(image * (1.0 + 0.05 * np.cos(k))), 0, 255).astype(np.uint8) for k, image in enumerate(empty)]
    assert not with_people(lit).any()


@pytest.mark.parametrize(("count", "images"), [(1, COUNT), (4, COUNT), (10, COUNT), (1, 3), (1, 4), (2, 5), (2, 6), (3, 7)])
def test_images_with_a_person_who_enters_or_leaves_are_found_and_one_beside_them(count: int, images: int) -> None:
    empty, walking, _ = film()
    beside = int(images - count > FEWEST_EMPTY)
    enters = with_people([*empty[: images - count], *walking[:count]])
    assert np.flatnonzero(enters).tolist() == list(range(images - count - beside, images))
    leaves = with_people([*walking[:count], *empty[: images - count]])
    assert np.flatnonzero(leaves).tolist() == list(range(count + beside))


def test_a_person_who_stands_there_for_most_of_the_time_and_leaves_is_found_too() -> None:
    empty, walking, _ = film()
    stands = [walking[0]] * (COUNT - 6)
    assert np.flatnonzero(with_people([*stands, *empty[:6]])).tolist() == list(range(COUNT - 5))


def test_nothing_is_stated_about_two_images_and_about_what_comes_and_goes() -> None:
    empty, walking, _ = film()
    assert not with_people([empty[0], walking[0]]).any()
    curtain = [(walking if k % 6 == 0 else empty)[k] for k in range(COUNT)]
    assert not with_people(curtain).any()


def test_edges_tell_a_person_from_the_place_that_one_has_left() -> None:
    empty, walking, masks = film()
    room, occupied = learn(empty).mean, learn([walking[0]] * 4).mean
    here, known = outline_shares(walking[0], room, masks[0])
    assert here > 10.0 * known
    here, known = outline_shares(empty[0], occupied, masks[0])
    assert known > 10.0 * here


@pytest.mark.parametrize("value", [0, 1])
@pytest.mark.filterwarnings("error")
def test_a_mask_without_an_outline_states_nothing(value: int) -> None:
    empty, _, masks = film()
    mask = np.full_like(masks[0], value)
    assert outline_shares(empty[0], learn(empty).mean, mask) == (0.0, 0.0)
