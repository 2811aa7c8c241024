"""Search, certainty and adjustment of offsets, with curves made by hand."""

from dataclasses import dataclass

import numpy as np

from zenocap.common.lags.pairs import Curve, Lag, Limits, VideoOffset, offsets_of

LIMITS = Limits(margin=5.0, ratio=1.2, apart_s=0.1, error_s=0.02, max_lag_s=2.0)


@dataclass(frozen=True)
class Made:
    """A curve with peaks of given heights; the refined lag is the given one where it is near."""

    lag_s: float
    height: float
    others: tuple[tuple[float, float], ...] = ()
    error_s: float = 0.001

    @property
    def curve(self) -> Curve:
        values = np.zeros(601)
        for lag_s, height in ((self.lag_s, self.height), *self.others):
            values[300 + round(lag_s / 0.01)] = height
        return Curve(0.01, values)

    def refined(self, lag_s: float) -> Lag | None:
        return Lag(self.lag_s, self.error_s, 1.0) if abs(lag_s - self.lag_s) < 0.05 else None


def found(pairs: dict[tuple[str, str], Made], names: str = "abc", **known: float) -> dict[str, VideoOffset]:
    return offsets_of(list(names), pairs, LIMITS, known)


def test_offsets_follow_from_pairs_in_any_order() -> None:
    result = found({("b", "a"): Made(-0.5, 20), ("b", "c"): Made(1.0, 20)})
    assert [round(one.offset_s, 6) for one in result.values()] == [0.0, 0.5, 1.5]
    assert not any(one.reason for one in result.values())


def test_a_weak_pair_is_certain_together_with_others() -> None:
    ambiguous = Made(1.0, 10, ((0.3, 8.0),))
    assert found({("a", "b"): ambiguous}, "ab")["b"].reason == "other offsets fit nearly as well"
    pairs = {("a", "c"): Made(0.4, 30), ("a", "b"): ambiguous, ("c", "b"): Made(0.6, 10, ((-1.2, 8.0),))}
    result = found(pairs)
    assert not result["b"].reason
    assert abs(result["b"].offset_s - 1.0) < 1e-6


def test_a_pair_that_contradicts_the_others_loses_weight() -> None:
    pairs = {("a", "b"): Made(0.5, 30), ("a", "c"): Made(1.0, 30), ("b", "c"): Made(0.5, 30)}
    pairs |= {("a", "d"): Made(0.2, 30), ("b", "d"): Made(-0.3, 30), ("c", "d"): Made(-0.76, 30)}
    result = found(pairs, "abcd")
    assert abs(result["d"].offset_s - 0.2) < 0.006  # by the plain mean 0.213
    assert result["d"].error_s > 0.001


def test_too_little_out_of_range_and_alone_have_reasons() -> None:
    assert found({("a", "b"): Made(0.5, 3)}, "ab")["b"].reason == "the videos have too little in common"
    assert "--max-offset" in found({("a", "b"): Made(2.5, 30)}, "ab")["b"].reason
    result = found({("a", "b"): Made(0.5, 30)})
    assert result["c"].reason == "nothing in common with the others"
    assert not result["b"].reason
    assert all(one.reason for one in found({}).values())


def test_an_inexact_lag_is_not_certain() -> None:
    assert found({("a", "b"): Made(0.5, 30, error_s=0.1)}, "ab")["b"].reason


def test_known_offsets_stay() -> None:
    result = found({("a", "b"): Made(0.7, 30), ("b", "c"): Made(1.0, 30)}, a=0.0, b=0.5)
    assert (result["a"].offset_s, result["b"].offset_s) == (0.0, 0.5)
    assert abs(result["c"].offset_s - 1.5) < 1e-6
