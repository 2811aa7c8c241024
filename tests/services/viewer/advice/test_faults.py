"""Camera advice: each fault of a simulated film is found, and none without it."""

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.support.walkers import walker
from zenocap.common.arrays import Image
from zenocap.common.camera_advice import TakeAdvice, found_text
from zenocap.common.messages import AdviceCode, CameraAdvice
from zenocap.common.rig.sources import FirstFrames, parse_background
from zenocap.common.vision.background import Background
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.segmentation import learn, segment
from zenocap.services.viewer.states import LearningBackground, ViewerSetup
from zenocap.simulation.rendering.camera import SimulatedCamera

FPS, EMPTY, SECONDS, SEED, SIZE = 10, 10, 9, 3, (240, 180)
A = AdviceCode


@cache
def film(gloss: float = 0.0, like_wall: bool = False) -> tuple[Image, ...]:
    """EMPTY images of the empty room, then the person walks."""
    scene = walker(SEED, 2, SIZE)
    subject = scene.person
    camera = scene.cameras["cam01"]
    if like_wall:
        room = SimulatedCamera(camera, subject, SEED).empty()
        blue, green, red = (float(value) for value in np.median(room[: SIZE[1] // 2].reshape(-1, 3), axis=0))
        worn = replace(subject.clothing, shirt_bgr=(blue, green, red), trouser_bgr=(blue, green, red), stripes=0.0)
        subject = replace(subject, clothing=worn)
    rendered = SimulatedCamera(camera, subject, SEED)
    images = [rendered.render(None, k) for k in range(EMPTY)]
    return (
        *images,
        *(rendered.render(scene.motion.pose_at(k / FPS), EMPTY + k, gloss=gloss) for k in range(SECONDS * FPS)),
    )


def found(
    images: list[Image] | tuple[Image, ...], background: str = f"first:{EMPTY}", plate: Image | None = None
) -> list[CameraAdvice]:
    """Advice of a viewer of these images.  plate: the picture of `background`."""
    camera = walker(SEED, 2, SIZE).cameras["cam01"]
    setup = ViewerSetup("1", camera, parse_background(background, Path()), plate=plate)
    state, scene, advice = LearningBackground(), None, []
    for k, image in enumerate(images):
        if scene is None:
            state, scene = learn(setup, state, image)
            continue
        scene, _, messages = segment(setup, scene, Frame(k, k * 1_000_000_000 // FPS, image))
        advice += [message for message in messages if isinstance(message, CameraAdvice)]
    return advice


def learnt(images: list[Image] | tuple[Image, ...]) -> Background:
    """Background of images that should be empty."""
    setup = ViewerSetup("1", walker(SEED, 2, SIZE).cameras["cam01"], FirstFrames(len(images)))
    state, scene = LearningBackground(), None
    for image in images:
        state, scene = learn(setup, state, image)
    assert scene is not None
    assert isinstance(scene.background, Background)
    return scene.background


def codes(
    images: list[Image] | tuple[Image, ...], background: str = f"first:{EMPTY}", plate: Image | None = None
) -> set[AdviceCode]:
    """Codes that count for the whole film, see `found`."""
    collected = TakeAdvice()
    for message in found(images, background, plate):
        collected.add(message)
    return {one.fault.code for one in collected.faults()}


@pytest.mark.nightly
def test_a_good_film_has_no_advice_and_a_message_each_second() -> None:
    advice = found(film())
    assert [message.faults for message in advice] == [[]] * len(advice)
    assert len(advice) == SECONDS - 1  # the first second ends with the first message


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("code", "share"),
    [
        (A.DARK, lambda _: 0.2),
        (A.SATURATED, lambda _: 1.9),
        (A.LIGHT_DRIFT, lambda k: 1.0 - 0.004 * k),
        (A.WHITE_BALANCE, lambda k: [1.0 - 0.002 * k, 1.0, 1.0 + 0.002 * k]),
        (A.FLICKER, lambda k: 1.0 + 0.05 * np.cos(2.0 * np.pi * 0.37 * k)),
    ],
)
def test_faults_of_the_light_are_found(code: AdviceCode, share: Callable[[int], object]) -> None:
    lit = [np.clip(np.rint(image * np.asarray(share(k))), 0, 255).astype(np.uint8) for k, image in enumerate(film())]
    assert code in {fault.code for message in found(lit) for fault in message.faults}


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("images", "allowed"),
    [
        (lambda: [np.asarray(cv2.GaussianBlur(image, (0, 0), 4.0), dtype=np.uint8) for image in film()], {A.FOCUS}),
        (lambda: film(like_wall=True), {A.CONTRAST, A.HOLES}),
        (lambda: film(gloss=0.5), {A.GLOSSY_FLOOR, A.CONTRAST, A.HOLES}),
    ],
    ids=["soft-image", "clothes-like-the-wall", "glossy-floor"],
)
def test_faults_of_the_image_are_found(images: Callable[[], list[Image]], allowed: set[AdviceCode]) -> None:
    assert codes(images()) & allowed


@pytest.mark.slow
def test_a_person_without_feet_in_the_image_is_cut_off() -> None:
    lifted = [np.asarray(np.roll(image, SIZE[1] // 3, axis=0)) for image in film()]
    assert A.CUT_OFF in codes(lifted)


@pytest.mark.slow
@pytest.mark.parametrize(("count", "early", "learns"), [(EMPTY, 2, EMPTY - 3), (5, 1, 3), (5, 2, 2), (3, 1, 2)])
def test_a_person_in_the_empty_scene_is_stated_and_not_learnt(count: int, early: int, learns: int) -> None:
    """The background is that of the images without the person, and without the one before where two others remain."""
    empty, walking = film()[:EMPTY], film()[EMPTY:]
    entered = [*empty[: count - early], *walking]
    assert codes(entered, f"first:{count}") == {A.OCCUPIED}
    assert A.OCCUPIED not in codes(film(), f"first:{count}")
    before, after = learnt(empty[:learns]), learnt(entered[:count])
    np.testing.assert_array_equal(after.mean, before.mean)


@pytest.mark.slow
def test_where_too_few_images_are_empty_all_are_learnt_and_the_advice_does_not_deny_it() -> None:
    entered = [*film()[:1], *film()[EMPTY:]]
    occupied = [one for message in found(entered, "first:3") for one in message.faults if one.code == A.OCCUPIED]
    assert re.fullmatch("a person is in 67 % of the .*; left out where enough show none", found_text(occupied[0]))
    assert not np.array_equal(learnt(entered[:3]).mean, learnt(entered[:1]).mean)


@pytest.mark.slow
def test_a_person_in_the_picture_of_the_empty_scene_is_stated() -> None:
    empty, walking = film()[0], film()[EMPTY:]
    assert A.UNCOVERED in codes(walking, "image:room.png", walking[6 * FPS])
    assert codes(walking, "image:room.png", empty) == set()


def beside(shown: tuple[Image, ...], later: int) -> list[Image]:
    """The film with the person twice: also as `later` images later, where they differ from the empty room."""
    room = np.median(np.stack(film()[:EMPTY]), axis=0)
    both = list(shown)
    for k in range(EMPTY, len(shown)):
        other = shown[EMPTY + (k - EMPTY + later) % (len(shown) - EMPTY)]
        differs = np.abs(other - room).max(axis=2, keepdims=True) > 30.0
        both[k] = np.where(differs, other, shown[k]).astype(np.uint8)
    return both


@pytest.mark.slow
def test_a_second_person_is_stated() -> None:
    assert A.PEOPLE in codes(beside(film(), 25))
    assert not {A.PEOPLE, A.UNCOVERED} & codes(film())


@pytest.mark.slow
def test_advice_depends_on_the_images_alone() -> None:
    assert found(film()) == found(film())
