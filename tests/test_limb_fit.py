"""One limb taken off, searched, and put back."""

import numpy as np
import pytest
from limb_cases import assert_consistent, begun_off
from two_view_scene import directions

from services.viewer.limb_fit import FREE, LimbFit
from services.viewer.limb_search import ARM_REGION, BOTH, LOWER

TRUTH = directions(right_shoulder_z=100)


def test_a_limb_put_back_at_once_changes_nothing() -> None:
    fit = begun_off(0, TRUTH, 0, BOTH, 10)
    cover, totals, score = fit.picture.cover.copy(), fit.picture.totals.copy(), fit.score()
    result = LimbFit(fit, 0).done()
    np.testing.assert_array_equal(fit.picture.cover, cover)
    np.testing.assert_array_equal(fit.picture.totals, totals)
    assert result.score == score
    assert result.matchings == ()


def test_searches_never_lose_what_was_found() -> None:
    fit = begun_off(0, TRUTH, 0, BOTH, 20)
    search = LimbFit(fit, 0)
    scores = []
    for what in (BOTH, LOWER, BOTH, LOWER):
        search.turn(what, ARM_REGION)
        scores.append(search.score)
    assert scores == sorted(scores)
    result = search.done()
    assert result.score == pytest.approx(scores[-1])
    assert len(result.matchings) == 4
    assert_consistent(fit)


def test_another_start_must_be_worth_it() -> None:
    fit = begun_off(0, TRUTH, 0, BOTH, 0)
    search = LimbFit(fit, 0)
    search.turn(BOTH, ARM_REGION)
    found, score = search.directions.copy(), search.score

    def elsewhere() -> None:
        search.start(directions(right_shoulder_z=20)[0])
        search.turn(BOTH, ARM_REGION)

    search.better_of(elsewhere, 0.0)
    np.testing.assert_array_equal(search.directions, found)
    assert search.score == score
    search.done()
    assert_consistent(fit)


def test_a_better_start_is_taken() -> None:
    fit = begun_off(0, TRUTH, 0, BOTH, 90)
    search = LimbFit(fit, 0)
    search.turn(LOWER, ARM_REGION)

    def at_the_truth() -> None:
        search.start(TRUTH[0])
        search.turn(BOTH, ARM_REGION)

    search.better_of(at_the_truth, 0.01)
    np.testing.assert_allclose(search.directions, TRUTH[0], atol=1e-9)


def test_a_sweep_looks_all_the_way_round() -> None:
    fit = begun_off(0, TRUTH, 0, BOTH, 180)
    search = LimbFit(fit, 0)
    search.sweep(BOTH, 2 * FREE, float(np.radians(15)))
    assert np.max(np.abs(search.directions - TRUTH[0])) < 0.3


def test_the_axis_of_slant_lies_in_the_image() -> None:
    search = LimbFit(begun_off(0, TRUTH, 0, BOTH, 0), 0)
    for part in (0, 1):
        axis = search.slant_axis(part)
        assert axis @ search.axis == pytest.approx(0.0, abs=1e-9)
        assert axis @ search.directions[part] == pytest.approx(0.0, abs=1e-2)
