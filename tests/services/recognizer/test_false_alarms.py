"""Rates of false postures: upper limits, the duration that shows them, and the least share of votes."""

import numpy as np
import pytest

from zenocap.services.recognizer.false_alarms import FalseAlarms, hours_needed, least_share, short_background, upper_rate


def test_without_an_event_the_upper_limit_is_the_rule_of_three() -> None:
    assert upper_rate(0, 1.0) == pytest.approx(3.0, abs=0.005)
    assert upper_rate(0, 10.0) == pytest.approx(0.3, abs=0.0005)
    assert hours_needed(1.0) == pytest.approx(3.0, abs=0.005)


@pytest.mark.parametrize("mean", [0.5, 2.0, 7.0])
def test_upper_limits_cover_the_rate_in_95_of_100_experiments_or_more(mean: float) -> None:
    counts = np.random.default_rng(3).poisson(mean, 4000)
    covered = np.mean([upper_rate(int(count), 1.0) >= mean for count in counts])
    assert covered >= 0.94
    assert np.mean([upper_rate(int(count), 1.0) >= 2.5 * mean + 4.0 for count in counts]) < 0.5


@pytest.mark.parametrize(
    ("per_hour", "left"), [(6.0, 0), (9.4, 0), (9.5, 1), (12.5, 1), (12.6, 2), (21.0, 4), (21.1, 5), (0.1, 0), (100.0, 5)]
)
def test_the_least_share_leaves_as_many_as_show_the_rate(per_hour: float, left: int) -> None:
    shares = np.array([0.0, 0.02, 0.10, 0.30, 0.31])
    least = least_share(shares, 0.5, per_hour, 0.01)
    alarms = FalseAlarms(0.5, shares, least)
    assert alarms.count == left
    assert alarms.most_per_hour <= per_hour or left == 0
    if left < len(shares):
        assert FalseAlarms(0.5, shares, least - 0.006).most_per_hour > per_hour


def test_false_postures_with_all_votes_are_left_up_to_the_rate() -> None:
    shares = np.array([0.4, 0.7, 1.0, 1.0])
    assert least_share(shares, 0.5, 4.0, 0.01) == pytest.approx(0.705)
    assert least_share(shares, 0.5, 3.9, 0.01) > 1.0


@pytest.mark.slow
@pytest.mark.parametrize("per_hour", [1.0, 6.0, 20.0])
def test_a_background_that_is_long_enough_holds_the_rate_for_others_in_95_of_100_cases(per_hour: float) -> None:
    """Shares of false postures of which as many an hour exceed s as `rate(s)`, in backgrounds of 3.5 hours."""
    rng, hours, within = np.random.default_rng(5), 3.5, []
    for _ in range(2000):
        shares = np.sort(rng.uniform(size=rng.poisson(40.0 * hours)))
        least = least_share(shares, hours, per_hour, 1e-9)
        within.append(40.0 * (1.0 - min(least, 1.0)) <= per_hour)
    assert np.mean(within) >= 0.94


def test_a_background_too_short_for_the_rate_is_a_warning_with_the_duration_needed() -> None:
    alarms = FalseAlarms(0.5, np.array([0.4, 0.7]), least=0.6)
    assert short_background(alarms, 6.0) == (
        "the background does not show 6 an hour: 1 false in 30.0 min of background: 2 an hour, with 95 % confidence at "
        "most 9.49; needed for 6 an hour: 30 min without a false one, or more"
    )
    assert short_background(alarms, 9.5) is None
    assert short_background(alarms, None) is None
    assert short_background(None, 6.0) is None
