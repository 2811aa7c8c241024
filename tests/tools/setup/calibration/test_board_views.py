"""Velocities of corners against a known motion; coverage."""

import numpy as np
import pytest

from zenocap.tools.setup.calibration.board_views import CameraViews, View, with_velocities

PERIOD_S = 0.1
START = np.array([[100.0, 50.0], [140.0, 52.0], [180.0, 51.0], [100.0, 90.0], [141.0, 92.0], [180.0, 95.0]])


def at(time_s: float) -> np.ndarray:
    """Pixels of six corners: each has a velocity of its own, and all have one acceleration."""
    own = np.array([[10.0 * k, -5.0 * k] for k in range(6)])
    return START + own * time_s + 0.5 * np.array([30.0, -20.0]) * time_s**2


def velocity(time_s: float) -> np.ndarray:
    return np.array([[10.0 * k, -5.0 * k] for k in range(6)]) + np.array([30.0, -20.0]) * time_s


def view(time_s: float, ids=range(6)) -> View:
    chosen = np.array(list(ids))
    return View(time_s, chosen, at(time_s)[chosen], np.full((len(chosen), 2), np.nan))


def test_velocities_are_central_differences_inside_and_one_sided_at_the_ends():
    found = with_velocities([view(k * PERIOD_S) for k in (3, 0, 4, 2, 1)], PERIOD_S)  # in any order
    assert [one.time_s for one in found] == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4])
    for one in found[1:-1]:
        assert one.velocities == pytest.approx(velocity(one.time_s), abs=1e-9)  # exact for an acceleration
    for one, sign in ((found[0], 1), (found[-1], -1)):
        assert one.velocities == pytest.approx(velocity(one.time_s + sign * PERIOD_S / 2), abs=1e-9)


def test_corners_seen_in_one_neighbour_only_have_its_difference():
    now = 5 * PERIOD_S
    views = [view(now - PERIOD_S, (0, 1, 2)), view(now, (0, 1, 3, 4)), view(now + PERIOD_S, (1, 3, 5))]
    found = with_velocities(views, PERIOD_S)[1]
    assert found.velocities[1] == pytest.approx(velocity(now)[1], abs=1e-9)  # 1: in all three
    assert found.velocities[0] == pytest.approx(velocity(now - PERIOD_S / 2)[0], abs=1e-9)  # 0: before and now
    assert found.velocities[2] == pytest.approx(velocity(now + PERIOD_S / 2)[3], abs=1e-9)  # 3: now and after
    assert found.velocities[3] == pytest.approx(found.velocities[:3].mean(axis=0))  # 4: the mean of the others


def test_without_a_near_neighbour_velocities_are_unknown():
    lonely = with_velocities([view(0.0), view(1.0), view(1.0 + PERIOD_S)], PERIOD_S)
    assert np.isnan(lonely[0].velocities).all()
    assert np.isnan(lonely[0].speed)
    assert not np.isnan(lonely[1].velocities).any()
    strangers = with_velocities([view(0.0, (0, 1)), view(PERIOD_S, (2, 3))], PERIOD_S)
    assert all(np.isnan(one.velocities).all() for one in strangers)


def test_a_missing_frame_is_bridged():
    found = with_velocities([view(0.0), view(2 * PERIOD_S)], PERIOD_S)
    assert found[0].velocities == pytest.approx(velocity(PERIOD_S), abs=1e-9)


def test_speed_is_the_mean_length():
    one = View(0.0, np.arange(2), np.zeros((2, 2)), np.array([[3.0, 4.0], [0.0, 1.0]]))
    assert one.speed == pytest.approx(3.0)


def test_coverage_is_the_share_of_cells_with_corners():
    corners = View(0.0, np.arange(3), np.array([[0.0, 0.0], [1.0, 1.0], [639.0, 479.0]]), np.zeros((3, 2)))
    outside = View(0.0, np.arange(1), np.array([[-2.0, 500.0]]), np.zeros((1, 2)))
    assert CameraViews("a", (640, 480), 0.1, 9, (corners,)).coverage == pytest.approx(2 / 24)
    assert CameraViews("a", (640, 480), 0.1, 9, (corners, outside)).coverage == pytest.approx(3 / 24)
    assert CameraViews("a", (640, 480), 0.1, 9, ()).coverage == 0.0
