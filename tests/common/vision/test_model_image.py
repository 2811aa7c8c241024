"""The cover image against pixel counts, and the outlines of parts against sampled cylinders."""

from math import exp

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.two_view_scene import rows
from zenocap.common.arrays import Bools, Floats, Floats32, Ints, Mask
from zenocap.common.vision import model_image

HEIGHT, WIDTH = 24, 32
SEEDS = st.integers(0, 2**32 - 1)
MASK = (np.random.default_rng(4).uniform(size=(HEIGHT, WIDTH)) < 0.5).astype(np.uint8)


def random_outline(seed: int) -> Floats:
    """A convex outline, partly or wholly outside the image at times."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-8, 40, 2) + rng.uniform(0.5, 14) * rng.normal(size=(8, 2))
    hull = cv2.convexHull(points.astype(np.float32))[:, 0].astype(np.float64)
    return np.ascontiguousarray(hull if seed % 2 else hull[::-1])


def inside(outline: Floats) -> Bools:
    """Oracle: pixels whose centre is on the inner side of every edge."""
    x, y = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    signs = [
        (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])
        for a, b in zip(outline, np.roll(outline, -1, 0), strict=True)
    ]
    return np.all(np.array(signs) >= 0, axis=0) | np.all(np.array(signs) <= 0, axis=0)


def empty_cover() -> tuple[Mask, Ints]:
    return np.zeros((HEIGHT, WIDTH), np.uint8), np.array([MASK.sum(), 0, 0], np.int64)


def counted_totals(cover: Mask) -> list[int]:
    return [int(MASK.sum()), int((cover > 0).sum()), int(((cover > 0) & (MASK > 0)).sum())]


@pytest.mark.slow
@given(SEEDS)
@settings(max_examples=300)  # the first example compiles
def test_an_outline_covers_the_pixels_whose_centres_it_contains(seed: int) -> None:
    cover, totals = empty_cover()
    model_image.cover_outline(random_outline(seed), MASK, cover, model_image.ADD, totals)
    np.testing.assert_array_equal(cover, inside(random_outline(seed)).astype(np.uint8))


@pytest.mark.slow
@given(st.lists(st.tuples(SEEDS, st.booleans()), min_size=1, max_size=8))
def test_incremental_totals_equal_counted_pixels(steps: list[tuple[int, bool]]) -> None:
    cover, totals = empty_cover()
    placed: list[Floats] = []
    for seed, remove in steps:
        if remove and placed:
            model_image.cover_outline(placed.pop(seed % len(placed)), MASK, cover, model_image.REMOVE, totals)
        else:
            placed.append(random_outline(seed))
            model_image.cover_outline(placed[-1], MASK, cover, model_image.ADD, totals)
        assert totals.tolist() == counted_totals(cover)
        np.testing.assert_array_equal(
            cover, sum(inside(outline).astype(np.uint8) for outline in placed) + np.zeros_like(cover)
        )
    for outline in placed:
        model_image.cover_outline(outline, MASK, cover, model_image.REMOVE, totals)
    assert not cover.any()
    assert totals.tolist() == [int(MASK.sum()), 0, 0]


@given(SEEDS, SEEDS)
def test_count_mode_gives_the_totals_of_add_mode_without_changing_the_cover(first: int, second: int) -> None:
    cover, totals = empty_cover()
    model_image.cover_outline(random_outline(first), MASK, cover, model_image.ADD, totals)
    before, by_counting = cover.copy(), totals.copy()
    model_image.cover_outline(random_outline(second), MASK, cover, model_image.COUNT, by_counting)
    np.testing.assert_array_equal(cover, before)
    model_image.cover_outline(random_outline(second), MASK, cover, model_image.ADD, totals)
    np.testing.assert_array_equal(by_counting, totals)


def random_part(seed: int) -> tuple[Floats, Floats]:
    """Frame (3, 4) and size (3,) of a part of a person's size near the middle of the action region."""
    rng = np.random.default_rng(seed)
    rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    if np.linalg.det(rotation) < 0:
        rotation[:, 0] *= -1
    frame = np.column_stack([rotation, rng.uniform([-0.6, 0.4, -0.6], [0.6, 1.6, 0.6])])
    return np.ascontiguousarray(frame), np.array([rng.uniform(0.1, 0.6), rng.uniform(0.03, 0.22), rng.uniform(0.03, 0.22)])


def sampled_hull(frame: Floats, size: Floats, camera: Floats) -> Floats32:
    turn = np.linspace(0, 2 * np.pi, 200)
    ring = np.stack([size[1] * np.cos(turn), 0 * turn, size[2] * np.sin(turn)], axis=1)
    world = np.concatenate([ring, ring + np.array([0, size[0], 0])]) @ frame[:, :3].T + frame[:, 3]
    local = world @ camera[:3].T + camera[3]
    pixels = camera[4, 0] * local[:, :2] / local[:, 2:] + camera[4, 1:]
    return np.asarray(cv2.convexHull(pixels.astype(np.float32)), dtype=np.float32)


@pytest.mark.nightly
@given(SEEDS, st.sampled_from([0, 1]))
@settings(max_examples=200)
def test_a_parts_outline_is_the_hull_of_its_projected_cylinder(seed: int, viewer: int) -> None:
    """Within a pixel of 160 x 120: ten corners stand for two ellipses under local parallel projection."""
    camera = rows(viewer)
    frame, size = random_part(seed)
    corners = np.empty((model_image.CORNERS, 2))
    assert model_image.part_outline(frame, size, camera, corners)
    hull = sampled_hull(frame, size, camera)
    found = cv2.convexHull(corners.astype(np.float32))
    for a, b in ((hull, found), (found, hull)):
        outside = [-cv2.pointPolygonTest(b, (float(x), float(y)), True) for x, y in a[:, 0]]
        assert max(outside) < 1.2


@given(SEEDS, st.sampled_from([0, 1]))
def test_a_parts_corners_are_in_order(seed: int, viewer: int) -> None:
    corners = np.empty((model_image.CORNERS, 2))
    assert model_image.part_outline(*random_part(seed), rows(viewer), corners)
    edges = np.roll(corners, -1, 0) - corners
    following = np.roll(edges, -1, 0)
    turns = edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0]
    assert np.all(turns > -0.3) or np.all(turns < 0.3)


def test_a_part_behind_the_camera_covers_nothing() -> None:
    camera = rows(0)
    frame = np.column_stack([np.eye(3), [0.0, 1.0, 7.0]])
    assert not model_image.part_outline(frame, np.array([0.5, 0.1, 0.1]), camera, np.empty((model_image.CORNERS, 2)))


def test_a_part_seen_along_its_axis_is_its_ellipse() -> None:
    camera = rows(0)  # looks along -Z from (0, 1, 5.2)
    frame = np.column_stack([[1, 0, 0], [0, 0, -1], [0, 1, 0], [0.0, 1.0, 0.0]]).astype(np.float64)
    corners = np.empty((model_image.CORNERS, 2))
    assert model_image.part_outline(frame, np.array([1e-9, 0.3, 0.1]), camera, corners)
    scale = camera[4, 0] / 5.2
    assert np.ptp(corners[:, 0]) <= 2 * 0.3 * scale + 1e-6
    np.testing.assert_allclose(np.ptp(corners[:, 1]), 2 * 0.1 * scale, rtol=0.3)


COUNTS = st.tuples(*[st.integers(0, 50)] * 3)  # pixels of both images, of the silhouette only, of the model image only


def score(both: int, missing: int, more: int) -> float:
    return float(model_image.score_of_counts(both + missing, both + more, both))


def test_the_matching_score_equals_equation_1_computed_by_hand() -> None:
    assert score(3, 1, 1) == pytest.approx(exp(-0.4) * 0.8)


def test_scores_of_empty_images() -> None:
    assert (score(0, 0, 0), score(0, 9, 0), score(0, 0, 9)) == (1.0, 0.0, pytest.approx(exp(-1)))


@given(COUNTS, st.integers(1, 50))
def test_more_errors_lower_the_score(counts: tuple[int, int, int], differing: int) -> None:
    """Pixels of the union that agreed and now differ do not change the union."""
    both, missing, more = counts
    assert score(both, missing + differing, more) < score(both + differing, missing, more)


@given(COUNTS)
def test_the_score_is_from_0_to_1_and_1_of_equal_images(counts: tuple[int, int, int]) -> None:
    assert 0.0 <= score(*counts) <= 1.0
    assert score(counts[0], 0, 0) == 1.0


def test_a_missing_model_pixel_costs_more_than_an_extra_one() -> None:
    assert score(5, 5, 0) < score(5, 0, 5)
