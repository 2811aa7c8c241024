"""Support of viewing lines against their intersection, with every view and without each."""

import numpy as np
import pytest
from scipy.ndimage import binary_dilation

from tests.support.puppets import ring, silhouette, walker
from zenocap.common.arrays import Floats, Ints, Mask
from zenocap.services.tracker.hull.contour_rays import exclude_views, extract_outlines
from zenocap.services.tracker.hull.ray_intersection import surviving_intervals
from zenocap.services.tracker.hull.views import Silhouettes
from zenocap.services.tracker.parameters import MAX_LAG_FRAMES
from zenocap.services.tracker.view_check.line_support import (
    SUPPORTED,
    changed_fraction,
    lagged_unsupported,
    line_support,
    sample_lines,
    with_view_of,
)

CAMERAS = ring(5)


def masks_at(time_s: float, late: int = -1, late_s: float = 0.0) -> list[Mask | None]:
    return [silhouette(camera, walker(time_s - (late_s if k == late else 0.0))) for k, camera in enumerate(CAMERAS)]


def survives(view: Ints, directions: Floats, seen: Silhouettes) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    near, far = np.empty(len(view)), np.empty(len(view))
    surviving_intervals(view, directions, seen, near, far)
    return np.asarray(near <= far)


def test_line_support_equals_the_intervals_with_and_without_each_view() -> None:
    moment = extract_outlines(masks_at(1.0, late=1, late_s=0.25), CAMERAS, 400)
    seen = moment[1]
    view, directions = sample_lines(moment, 60, 0)
    found = line_support(view, directions, seen)
    assert 0.05 < np.mean(found != SUPPORTED) < 0.8
    # Both sample every two pixels, but at different places: only one may hit a thin region.
    assert np.mean((found == SUPPORTED) == survives(view, directions, seen)) > 0.96
    for j in range(len(CAMERAS)):
        others = view != j
        supported = (found[others] == SUPPORTED) | ((found[others] >> j) & 1 == 1)
        without_view = exclude_views(*moment, {j})[1]
        assert np.mean(supported == survives(view[others], directions[others], without_view)) > 0.96


def test_the_late_view_is_the_one_that_removes_support() -> None:
    moment = extract_outlines(masks_at(1.0, late=1, late_s=0.25), CAMERAS, 400)
    view, directions = sample_lines(moment, 60, 0)
    found = line_support(view, directions, moment[1])
    unsupported = found[(view != 1) & (found != SUPPORTED)]
    assert len(unsupported) > 20
    removing = [np.mean((unsupported >> j) & 1 == 1) for j in range(len(CAMERAS))]
    assert int(np.argmax(removing)) == 1
    assert removing[1] > 0.9


def test_change_is_the_share_of_pixels_that_differ() -> None:
    before, after = masks_at(1.0), masks_at(1.2)
    before[2] = None
    share = changed_fraction(extract_outlines(before, CAMERAS, 10)[1], extract_outlines(after, CAMERAS, 10)[1])
    assert np.isnan(share[2])
    for j in (0, 1, 3, 4):
        a, b = (binary_dilation(mask > 0, np.ones((3, 3))) for mask in (before[j], after[j]))
        assert share[j] == pytest.approx(np.mean((a != b)[b | a]) * np.count_nonzero(a | b) / np.count_nonzero(b))
    same = extract_outlines(after, CAMERAS, 10)[1]
    assert np.all(changed_fraction(same, same) == 0)


def test_one_view_is_replaced_by_that_of_another_moment() -> None:
    now, then = extract_outlines(masks_at(1.0), CAMERAS, 10)[1], extract_outlines(masks_at(1.3), CAMERAS, 10)[1]
    both = with_view_of(now, then, 3)
    assert changed_fraction(both, now)[[0, 1, 2, 4]].tolist() == [0.0] * 4
    assert changed_fraction(both, then)[3] == 0.0
    assert changed_fraction(both, now)[3] > 0.1


@pytest.mark.parametrize("late", [-2, 0, 1, 4])
def test_late_view_agrees_best_at_its_lag(late: int) -> None:
    recent = tuple(extract_outlines(masks_at(1.0 + k / 30, 2, late / 30), CAMERAS, 300) for k in range(MAX_LAG_FRAMES + 1))
    shares = lagged_unsupported(recent, 2, 30, 0)
    assert int(np.argmin(shares)) - MAX_LAG_FRAMES == late
    assert shares.min() < 0.03
