"""One limb removed from the model image, searched, and put back."""

import numpy as np
import pytest

from tests.support.limb_cases import assert_consistent, fit_started_off
from tests.support.two_view_scene import directions
from zenocap.common.arrays import Floats
from zenocap.services.viewer.parameters import ARM_REGION
from zenocap.services.viewer.two_view.limb_fit import HALF_TURN, LimbFit
from zenocap.services.viewer.two_view.limb_search import BOTH, LOWER

TRUTH = directions(right_shoulder_z=100)


def test_finishing_without_a_search_changes_nothing() -> None:
    fit = fit_started_off(0, TRUTH, 0, BOTH, 10)
    cover, totals, score = fit.image.cover.copy(), fit.image.totals.copy(), fit.score()
    result = LimbFit(fit, 0).finish()
    np.testing.assert_array_equal(fit.image.cover, cover)
    np.testing.assert_array_equal(fit.image.totals, totals)
    assert result.score == score
    assert result.matchings == ()


def test_searches_never_lower_the_score() -> None:
    fit = fit_started_off(0, TRUTH, 0, BOTH, 20)
    search, scores = LimbFit(fit, 0), []
    for what in (BOTH, LOWER, BOTH, LOWER):
        search.search(what, ARM_REGION)
        scores.append(search.score)
    assert scores == sorted(scores)
    result = search.finish()
    assert result.score == pytest.approx(scores[-1])
    assert len(result.matchings) == 4
    assert_consistent(fit)


def retry_from(search: LimbFit, start: Floats, gain: float) -> None:
    def search_from_the_start() -> None:
        search.start(start)
        search.search(BOTH, ARM_REGION)

    search.retry(search_from_the_start, gain)


def test_a_retry_without_gain_keeps_the_result() -> None:
    fit = fit_started_off(0, TRUTH, 0, BOTH, 0)
    search = LimbFit(fit, 0)
    search.search(BOTH, ARM_REGION)
    found, score = search.directions.copy(), search.score
    retry_from(search, directions(right_shoulder_z=20)[0], 0.0)
    np.testing.assert_array_equal(search.directions, found)
    assert search.score == score
    search.finish()
    assert_consistent(fit)


def test_a_retry_from_a_better_start_is_used() -> None:
    search = LimbFit(fit_started_off(0, TRUTH, 0, BOTH, 90), 0)
    search.search(LOWER, ARM_REGION)
    retry_from(search, TRUTH[0], 0.01)
    np.testing.assert_allclose(search.directions, TRUTH[0], atol=1e-9)


def test_a_sweep_covers_a_full_turn() -> None:
    search = LimbFit(fit_started_off(0, TRUTH, 0, BOTH, 180), 0)
    search.sweep(BOTH, 2 * HALF_TURN, float(np.radians(15)))
    assert np.max(np.abs(search.directions - TRUTH[0])) < 0.3


def test_the_slant_axis_is_in_the_image_plane() -> None:
    search = LimbFit(fit_started_off(0, TRUTH, 0, BOTH, 0), 0)
    for part in (0, 1):
        axis = search.slant_axis(part)
        assert axis @ search.axis == pytest.approx(0.0, abs=1e-9)
        assert axis @ search.directions[part] == pytest.approx(0.0, abs=1e-2)
