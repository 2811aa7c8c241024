"""Frame sets: images of several cameras that belong together, and their choice."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.board_views import board_views, room
from zenocap.tools.setup.calibration.board_views import CameraViews, View
from zenocap.tools.setup.calibration.frame_sets import chosen_frame_sets, frame_sets_near, shared_counts, usable

SIZE = (600, 400)


def view(time_s: float, place=(300.0, 200.0), speed: float = 10.0, moving: float = 60.0) -> View:
    """A board that moves by `moving` px/s: of one that rests, only the first view is used."""
    pixels = np.array(place) + np.array([moving * time_s, 0.0]) + 3.0 * np.array([[k % 3, k // 3] for k in range(6)])
    return View(time_s, np.arange(6), pixels, np.full((6, 2), speed / np.sqrt(2)))


def camera(times, period_s: float = 0.1, **options) -> CameraViews:
    return CameraViews("cam", SIZE, period_s, 99, tuple(view(time, **options) for time in times))


def times_of(frame_sets) -> list[tuple[float, ...]]:
    return [tuple(round(one.views[k].time_s, 3) for k in sorted(one.views)) for one in frame_sets if len(one.views) > 1]


def test_views_of_one_moment_are_paired_by_their_delays():
    times = [0.1 * k for k in range(6)]
    seen = [camera(times), camera([time + 0.35 for time in times])]  # the second video begins 0.35 s later
    together = chosen_frame_sets([seen[0], camera(times)], np.zeros(2))
    assert times_of(together) == [(round(time, 3),) * 2 for time in times]
    delayed = chosen_frame_sets(seen, np.array([0.0, -0.35]))
    assert times_of(delayed) == [(round(time, 3), round(time + 0.35, 3)) for time in times]
    assert [one.time_s for one in delayed] == pytest.approx(times)
    apart = chosen_frame_sets(seen, np.array([0.0, 10.0]))
    assert times_of(apart) == []
    assert len(apart) == 12  # each alone, for its lens


def test_cameras_of_different_rates_are_paired_to_the_nearest_frame():
    seen = [camera([0.1 * k for k in range(11)]), camera([k / 30 for k in range(31)], 1 / 30)]
    pairs = times_of(chosen_frame_sets(seen, np.zeros(2)))
    assert len(pairs) == 11
    assert all(one == pytest.approx(other, abs=0.6 / 30) for one, other in pairs)


@pytest.mark.slow
def test_a_simulated_board_is_paired_at_the_true_times():
    """Pairing by the true delays gives views of the same pose of the board."""
    delays = (0.0, 0.27)
    seen, _ = board_views(room(2), seconds=12.0, noise_px=0.0, delays_s=delays)
    frame_sets = [one for one in chosen_frame_sets(seen, np.array(delays)) if len(one.views) == 2]
    assert len(frame_sets) > 20
    for frame_set in frame_sets:
        shown = [frame_set.views[k].time_s + delays[k] for k in (0, 1)]
        assert shown[0] == pytest.approx(shown[1], abs=0.12)
        assert frame_set.time_s == pytest.approx(np.mean(shown), abs=0.06)


def test_views_of_unknown_speed_are_not_used():
    unknown = replace(view(0.1), velocities=np.full((6, 2), np.nan))
    assert not usable(unknown)
    seen = [CameraViews("a", SIZE, 0.1, 9, (view(0.0), unknown, view(0.2))), camera([0.0, 0.1, 0.2])]
    assert times_of(chosen_frame_sets(seen, np.zeros(2))) == [(0.0, 0.0), (0.2, 0.2)]


def test_no_views_give_no_frame_sets():
    assert chosen_frame_sets([camera([]), camera([])], np.zeros(2)) == []
    assert len(chosen_frame_sets([camera([]), camera([0.0, 0.1])], np.zeros(2))) == 2
    assert shared_counts([camera([]), camera([0.0])], np.zeros(2)) == {(0, 1): 0}


def test_shared_counts_are_those_of_each_pair():
    seen = [camera([0.0, 0.1, 0.2, 0.3]), camera([0.2, 0.3]), camera([0.3, 0.4])]
    assert shared_counts(seen, np.zeros(3)) == {(0, 1): 2, (0, 2): 1, (1, 2): 1}
    assert shared_counts(seen, np.array([0.0, -0.2, 0.0])) == {(0, 1): 2, (0, 2): 1, (1, 2): 0}


def test_slow_views_and_rare_places_come_first():
    slow = [view(0.1 * k, speed=5.0) for k in range(4)]
    fast = [view(1.0 + 0.1 * k, speed=900.0) for k in range(20)]
    seen = [CameraViews("a", SIZE, 0.1, 99, (*slow, *fast))] * 2
    assert [one.time_s < 0.9 for one in chosen_frame_sets(seen, np.zeros(2), max_shared=3, max_own=0)] == [True] * 3
    corner = view(3.0, place=(20.0, 20.0))
    seen = [CameraViews("a", SIZE, 0.1, 99, (*(view(0.1 * k) for k in range(20)), corner))] * 2
    chosen = chosen_frame_sets(seen, np.zeros(2), max_shared=2, max_own=0)
    assert any(one.views[0] is corner for one in chosen)


def test_numbers_of_frame_sets_are_limited():
    seen = [camera([0.1 * k for k in range(60)]), camera([0.1 * k for k in range(60)])]
    chosen = chosen_frame_sets(seen, np.zeros(2), max_shared=10, max_own=4)
    assert sum(len(one.views) == 2 for one in chosen) == 10
    assert sum(len(one.views) == 1 for one in chosen) == 8
    used = {id(view) for one in chosen for view in one.views.values()}
    assert len(used) == 28
    assert [one.time_s for one in chosen] == sorted(one.time_s for one in chosen)


def test_a_board_that_rests_counts_once():
    times = [0.1 * k for k in range(30)]
    resting = [camera(times, moving=0.0), camera(times, moving=0.0)]
    assert times_of(chosen_frame_sets(resting, np.zeros(2))) == [(0.0, 0.0)]
    half = [replace(one, views=tuple(view(time, moving=0.0 if time > 1.45 else 60.0) for time in times)) for one in resting]
    assert len(times_of(chosen_frame_sets(half, np.zeros(2)))) == 16


def test_frame_sets_near_a_time_are_spread_over_it_and_have_most_cameras():
    times = [0.1 * k for k in range(30)]
    seen = [camera(times, moving=0.0), camera(times[18:], moving=0.0)]
    near = frame_sets_near(seen, np.zeros(2), 2.0, 0.55, 3)
    assert [one.time_s for one in near] == pytest.approx([1.8, 2.1, 2.5], abs=0.11)
    assert all(len(one.views) == 2 for one in near)
    assert frame_sets_near(seen, np.zeros(2), 99.0, 0.5, 3) == []
