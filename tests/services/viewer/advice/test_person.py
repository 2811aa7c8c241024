"""Measures of the person in one image: what is missing in the silhouette, and mirror images."""

from functools import cache

import cv2
import numpy as np
import pytest

from zenocap.common.arrays import Image, Mask
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.rig.rig import demo_rig_file
from zenocap.common.vision.background import Background, learn
from zenocap.common.vision.extraction import extract
from zenocap.common.vision.silhouette import SilhouetteOptions
from zenocap.services.viewer.advice.person import PersonSample, others, seen_person
from zenocap.services.viewer.parameters import MANY_HOLES
from zenocap.simulation.body.person import person
from zenocap.simulation.motion.timeline import demo_timeline
from zenocap.simulation.rendering.camera import SimulatedCamera

SIZES = ((160, 120), (320, 240), (640, 480))
STRETCHED_S = (3.5, 4.5, 5.5)  # of the demo: the T-pose
STANDING_S = tuple(range(17, 29))  # of the demo: the person stands, and moves the arms
CRACK, FIRST_ROW = 0.04, 0.3  # of the person's height: width of a crack across the trunk, and its place
GLOSS = 0.35  # of the light that a glossy floor mirrors
Shots = tuple[tuple[Image, Mask], ...]  # images, and true silhouettes (height, width) of 0 and 1


@cache
def demo(size: tuple[int, int], seed: int, times_s: tuple[float, ...], gloss: float = 0.0) -> tuple[Background, Shots]:
    """The empty room of the demo's first camera, and what it sees at these times."""
    camera = read_calibration(demo_rig_file().parent / "demo-calibration.toml")["cam01"].resized(size)
    script = demo_timeline(person(seed), seed)
    film = SimulatedCamera(camera, script.person, seed)
    shots = tuple(
        (film.render(pose, 100 + k, gloss=gloss), np.asarray(film.silhouette(pose) != 0, dtype=np.uint8))
        for k, pose in enumerate(map(script.pose_at, times_s))
    )
    return learn([film.render(None, k) for k in range(20)]), shots


def measured(room: Background, image: Image, mask: Mask) -> PersonSample:
    return seen_person(image, room, mask, 0.0)[0]


@pytest.mark.nightly
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("seed", [4, 7])
def test_gaps_between_arms_and_trunk_are_not_missing(size: tuple[int, int], seed: int) -> None:
    room, shots = demo(size, seed, STANDING_S)
    assert max(measured(room, image, mask).holes for image, mask in shots) < MANY_HOLES


@pytest.mark.nightly
@pytest.mark.parametrize("size", SIZES)
def test_a_crack_across_the_trunk_is_missing(size: tuple[int, int]) -> None:
    room, shots = demo(size, 4, STANDING_S)
    for image, mask in shots:
        rows = np.flatnonzero(mask.any(axis=1))
        height = int(rows[-1] - rows[0] + 1)
        cut, first = mask.copy(), int(rows[0]) + round(FIRST_ROW * height)
        cut[first : first + max(2, round(CRACK * height))] = 0
        area = 100.0 * (int(np.count_nonzero(mask)) / int(np.count_nonzero(cut)) - 1.0)
        assert measured(room, image, cut).holes == pytest.approx(area, rel=0.5)


@pytest.mark.nightly
@pytest.mark.parametrize("size", SIZES)
def test_faint_trousers_are_no_mirror_image(size: tuple[int, int]) -> None:
    room, shots = demo(size, 4, STRETCHED_S)
    assert not any(measured(room, image, mask).mirrored for image, mask in shots)


@pytest.mark.nightly
def test_a_mirror_image_in_the_silhouette_is_found() -> None:
    room, shots = demo((320, 240), 4, STRETCHED_S, GLOSS)
    for image, mask in shots:
        found = extract(room, image, SilhouetteOptions())
        assert found.area > 1.3 * np.count_nonzero(mask)
        assert measured(room, image, found.mask).mirrored


HERE, THERE = (60, 50), (150, 60)  # places of the middle of a figure, px


def drawn(*places: tuple[int, int]) -> Image:
    """A room with a figure at each of the places, in even light."""
    rng = np.random.default_rng(3)
    room = cv2.GaussianBlur(rng.uniform(90.0, 160.0, (120, 200, 3)), (0, 0), 6.0)
    for x, y in places:
        cv2.ellipse(room, (x, y), (9, 30), 0.0, 0.0, 360.0, (40.0, 30.0, 200.0), -1)
    return np.clip(room + rng.normal(0.0, 1.0, room.shape), 0, 255).astype(np.uint8)


@pytest.mark.parametrize(
    ("empty", "now", "mask", "found"),
    [
        ((), (HERE,), HERE, (False, False)),
        ((), (HERE, THERE), HERE, (True, False)),
        ((THERE,), (HERE,), HERE, (False, True)),
        ((THERE,), (HERE,), THERE, (False, True)),
    ],
    ids=["alone", "two people", "left another place", "left the place of the silhouette"],
)
def test_another_person_and_a_place_that_one_has_left_are_distinguished(
    empty: tuple[tuple[int, int], ...], now: tuple[tuple[int, int], ...], mask: tuple[int, int], found: tuple[bool, bool]
) -> None:
    silhouette: Mask = np.zeros((120, 200), np.uint8)
    cv2.ellipse(silhouette, mask, (9, 30), 0.0, 0.0, 360.0, (1,), -1)
    assert others(drawn(*now), learn([drawn(*empty)] * 8), np.ones(3, np.float32), silhouette) == found


@pytest.mark.filterwarnings("error")
def test_a_silhouette_of_a_few_pixels_is_no_reason_for_another_person() -> None:
    empty, now = (np.repeat(np.repeat(drawn(*places), 8, axis=0), 8, axis=1) for places in ((), (THERE,)))
    silhouette: Mask = np.zeros(now.shape[:2], np.uint8)
    silhouette[33, 35] = 1
    assert others(now, learn([empty] * 4), np.ones(3, np.float32), silhouette) == (False, False)
