"""Measures of the person in one image: what is missing in the silhouette, and mirror images."""

from functools import cache

import numpy as np
import pytest

from zenocap.common.arrays import Image, Mask
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.rig.rig import demo_rig_file
from zenocap.common.vision.background import Background, learn
from zenocap.common.vision.extraction import extract
from zenocap.common.vision.silhouette import SilhouetteOptions
from zenocap.services.viewer.advice.person import PersonSample, seen_person
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
