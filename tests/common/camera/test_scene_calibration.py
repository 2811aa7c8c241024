"""Calibration from known points: exact without noise, true errors, named wrong picks."""

import numpy as np
import pytest

from tests.support.places import ROOT
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.camera.fisheye import FisheyeLens
from zenocap.common.camera.lens import Lens
from zenocap.common.camera.pinhole import Camera
from zenocap.common.camera.scene_calibration import CLICK_PX, placed_camera
from zenocap.common.errors import UserError

FLOOR = {"a": (0.0, 0.0, 0.0), "b": (1.5, 0.0, 0.0), "c": (0.0, 0.0, 1.5), "d": (-1.5, 0.0, -1.2)}
POINTS = FLOOR | {"e": (1.4, 1.2, -1.3), "f": (-1.5, 2.0, 1.0), "g": (0.0, 1.8, -1.5)}
RING = read_calibration(ROOT / "zenocap" / "data" / "rigs" / "ring-calibration.toml")
CAMERA = RING["cam01"]


def picks(camera: Camera, names: str, noise: float = 0.0, seed: int = 0) -> dict[str, tuple[float, float]]:
    rng = np.random.default_rng(seed)
    pixels = camera.project(np.array([POINTS[name] for name in names])) + noise * rng.standard_normal((len(names), 2))
    return {name: (float(x), float(y)) for name, (x, y) in zip(names, pixels, strict=True)}


def error_m(found: Camera, true: Camera, names: str) -> float:
    """Distance at a person in the middle of the points, 1 m high, across the view."""
    middle = np.mean([POINTS[name] for name in names], axis=0)
    middle[1] = 1.0
    px = np.linalg.norm(found.project(middle[None]) - true.project(middle[None]))
    return float(px * (true.rotation @ middle + true.translation)[2] / true.matrix[0, 0])


@pytest.mark.parametrize("camera", list(RING.values())[:3], ids=lambda camera: camera.name)
@pytest.mark.parametrize(("names", "known"), [("abcd", True), ("abcdefg", True), ("abcdefg", False)])
def test_exact_picks_give_the_camera(camera, names, known):
    placed = placed_camera("one", camera.size, POINTS, picks(camera, names), Lens.of(camera) if known else None)
    np.testing.assert_allclose(placed.camera.centre, camera.centre, atol=1e-4)
    np.testing.assert_allclose(placed.camera.matrix, camera.matrix, atol=1e-2)
    np.testing.assert_allclose(placed.camera.rotation, camera.rotation, atol=1e-5)
    assert not placed.remarks


@pytest.mark.slow
@pytest.mark.parametrize(("names", "known"), [("abcd", True), ("abcdefg", False)])
def test_the_claimed_error_is_the_true_one(names, known):
    lens = Lens.of(CAMERA) if known else None
    errors, claimed = [], []
    for seed in range(8):
        placed = placed_camera("one", CAMERA.size, POINTS, picks(CAMERA, names, CLICK_PX, seed), lens)
        errors.append(error_m(placed.camera, CAMERA, names))
        claimed.append(placed.error_m)
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(np.median(claimed), rel=0.5)


@pytest.mark.slow
@pytest.mark.parametrize("wrong", "bdf")
def test_a_wrong_pick_is_named(wrong):
    seen = picks(CAMERA, "abcdefg", 0.5)
    seen[wrong] = (seen[wrong][0] + 25.0, seen[wrong][1])
    placed = placed_camera("one", CAMERA.size, POINTS, seen, Lens.of(CAMERA))
    assert placed.suspect[0] == wrong
    assert placed.suspect[1] == pytest.approx(25.0, abs=6.0)
    assert f"one: {wrong} is " in placed.remarks[0]


def test_an_error_below_the_limit_moves_the_person_by_no_more_than_stated_and_is_not_noticed():
    exact = picks(CAMERA, "abcdefg")
    name, limit_px, moved_m = placed_camera("one", CAMERA.size, POINTS, exact, Lens.of(CAMERA)).unnoticed
    moved = []
    for angle in np.radians(range(0, 360, 90)):
        wrong = exact | {
            name: (exact[name][0] + 0.8 * limit_px * np.cos(angle), exact[name][1] + 0.8 * limit_px * np.sin(angle))
        }
        placed = placed_camera("one", CAMERA.size, POINTS, wrong, Lens.of(CAMERA))
        if placed.suspect is None:
            moved.append(error_m(placed.camera, CAMERA, "abcdefg"))
    assert max(moved) == pytest.approx(0.8 * moved_m, rel=0.2)


@pytest.mark.slow
def test_mirrored_images_are_recognized():
    for names, text in (("abcdefg", "fits as a mirrored image"), ("abcd", "below the floor: is the image mirrored")):
        mirrored = {name: (CAMERA.size[0] - 1 - x, y) for name, (x, y) in picks(CAMERA, names, 0.3).items()}
        placed = placed_camera("one", CAMERA.size, POINTS, mirrored, Lens.of(CAMERA))
        assert len(placed.remarks) == 1
        assert text in placed.remarks[0]


def test_a_fisheye_camera_is_placed_from_picks_in_its_own_images():
    matrix = np.array([[250.0, 0, 319.5], [0, 250.0, 239.5], [0, 0, 1]])
    fisheye = FisheyeLens(CAMERA.size, matrix, np.array([-0.01, 0.002, 0.0, 0.0]))
    world = np.array(list(POINTS.values()))
    seen = fisheye.project(world @ CAMERA.rotation.T + CAMERA.translation)
    pixels = {name: (float(x), float(y)) for name, (x, y) in zip(POINTS, seen, strict=True)}
    lens = Lens("one", CAMERA.size, matrix, fisheye.coefficients, fisheye=True)
    placed = placed_camera("one", CAMERA.size, POINTS, pixels, lens)
    np.testing.assert_allclose(placed.camera.centre, CAMERA.centre, atol=1e-3)
    assert placed.camera.fisheye is not None


@pytest.mark.parametrize(
    ("names", "points", "known", "text"),
    [
        ("abc", POINTS, True, "one: 3 points: allowed: at least 4"),
        ("abcde", POINTS, False, "one: 5 points: allowed: at least 6, or a lens file and 4"),
        ("abcd", POINTS | {k: (n * 0.5, 0.0, 0.0) for n, k in enumerate("abcd")}, True, "all points lie on one line"),
        ("abcdefg", {k: (x, 0.0, z) for k, (x, _, z) in POINTS.items()}, False, "all points lie in one plane"),
    ],
)
def test_points_that_do_not_suffice_are_refused(names, points, known, text):
    with pytest.raises(UserError, match=text):
        placed_camera("one", CAMERA.size, points, picks(CAMERA, names), Lens.of(CAMERA) if known else None)
