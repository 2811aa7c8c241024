"""Support of viewing lines against what cutting them says, with every view and without each."""

import numpy as np
import pytest

from common.vision.background import Mask
from services.tracker.agreement_lines import LAGS, lagged_shares, lines_of, mixed
from services.tracker.hull import outlines, without
from services.tracker.hull_rays import survive
from services.tracker.hull_support import SUPPORTED, changed, support
from services.tracker.hull_views import Floats, Integers, Silhouettes
from tests.puppets import ring, silhouette, walker

CAMERAS = ring(5)


def masks_at(time_s: float, late: int = -1, late_s: float = 0.0) -> list[Mask | None]:
    return [silhouette(camera, walker(time_s - (late_s if k == late else 0.0))) for k, camera in enumerate(CAMERAS)]


def survives(view: Integers, directions: Floats, seen: Silhouettes) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    near, far = np.empty(len(view)), np.empty(len(view))
    survive(view, directions, seen, near, far)
    return np.asarray(near <= far)


def test_what_has_support_survives_and_who_is_in_the_way_is_who_must_go() -> None:
    moment = outlines(masks_at(1.0, late=1, late_s=0.25), CAMERAS, 400)
    seen = moment[1]
    view, directions = lines_of(moment, 60, 0)
    found = support(view, directions, seen)
    assert 0.05 < np.mean(found != SUPPORTED) < 0.8
    # Both look at places two pixels apart, but not at the same ones: a sliver may be seen by one only.
    assert np.mean((found == SUPPORTED) == survives(view, directions, seen)) > 0.96
    for j in range(len(CAMERAS)):
        others = view != j
        rescued = (found[others] == SUPPORTED) | ((found[others] >> j) & 1 == 1)
        alone = without(*moment, {j})[1]
        assert np.mean(rescued == survives(view[others], directions[others], alone)) > 0.96


def test_a_view_in_the_wrong_is_the_one_in_the_way() -> None:
    moment = outlines(masks_at(1.0, late=1, late_s=0.25), CAMERAS, 400)
    view, directions = lines_of(moment, 60, 0)
    found = support(view, directions, moment[1])
    lacking = found[(view != 1) & (found != SUPPORTED)]
    assert len(lacking) > 20
    blamed = [np.mean((lacking >> j) & 1 == 1) for j in range(len(CAMERAS))]
    assert int(np.argmax(blamed)) == 1
    assert blamed[1] > 0.9


def test_change_is_the_share_of_pixels_that_differ() -> None:
    before, after = masks_at(1.0), masks_at(1.2)
    before[2] = None
    share = changed(outlines(before, CAMERAS, 10)[1], outlines(after, CAMERAS, 10)[1])
    assert np.isnan(share[2])
    for j in (0, 1, 3, 4):
        a, b = dilated(before[j]), dilated(after[j])
        assert share[j] == pytest.approx(np.mean((a != b)[b | a]) * np.count_nonzero(a | b) / np.count_nonzero(b))
    same = outlines(after, CAMERAS, 10)[1]
    assert np.all(changed(same, same) == 0)


def dilated(mask: Mask | None) -> np.ndarray[tuple[int, int], np.dtype[np.bool_]]:
    assert mask is not None
    wide = np.pad(mask > 0, 1)
    height, width = mask.shape
    grown = [wide[1 + y : 1 + y + height, 1 + x : 1 + x + width] for y in (-1, 0, 1) for x in (-1, 0, 1)]
    return np.asarray(np.any(grown, axis=0))


def test_mixing_takes_one_view_from_another_moment() -> None:
    now, then = outlines(masks_at(1.0), CAMERAS, 10)[1], outlines(masks_at(1.3), CAMERAS, 10)[1]
    both = mixed(now, then, 3)
    assert changed(both, now)[[0, 1, 2, 4]].tolist() == [0.0] * 4
    assert changed(both, then)[3] == 0.0
    assert changed(both, now)[3] > 0.1


@pytest.mark.parametrize("late", [-2, 0, 1, 4])
def test_a_late_view_agrees_best_at_its_lag(late: int) -> None:
    recent = tuple(outlines(masks_at(1.0 + k / 30, 2, late / 30), CAMERAS, 300) for k in range(LAGS + 1))
    shares = lagged_shares(recent, 2, 30, 0)
    assert int(np.argmin(shares)) - LAGS == late
    assert shares.min() < 0.03
