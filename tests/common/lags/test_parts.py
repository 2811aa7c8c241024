"""A comparison in parts has the result of the whole, bit for bit."""

import numpy as np
import pytest

from tests.support.moving_balls import mask_of, ring
from zenocap.common.lags.delays import lags_between, limits_of
from zenocap.common.lags.pairs import coarse_lags
from zenocap.common.lags.parts import ComparedPair, PairProgress, advance, compared
from zenocap.common.lags.tangents import outline_of, silhouette_pairs

CAMERAS = ring((0, 90, 200))
REACH_S = 1.0


def outlines(seconds: float):
    times = np.arange(round(20 * seconds)) / 20
    found = {
        name: [outline_of(camera, mask_of(camera, 5.0 + t - 0.1 * k), t) for t in times]
        for k, (name, camera) in enumerate(CAMERAS.items())
    }
    return {name: [one for one in its if one is not None] for name, its in found.items()}


@pytest.mark.nightly
def test_a_comparison_in_parts_is_that_of_the_whole():
    seen = outlines(16)
    whole = silhouette_pairs(CAMERAS, {name: seen[name] for name in CAMERAS}, REACH_S)
    parts: dict[tuple[str, str], ComparedPair] = {}
    for a, b in whole:
        one = silhouette_pairs({name: CAMERAS[name] for name in (a, b)}, {name: seen[name] for name in (a, b)}, REACH_S)
        whole[a, b] = one[a, b]
        progress, count = PairProgress((CAMERAS[a], CAMERAS[b]), (seen[a], seen[b]), REACH_S), 0
        while not progress.ended:
            progress, count = advance(progress), count + 1
        assert count > 8
        result = compared(progress)
        assert np.array_equal(result.curve.values, whole[a, b].curve.values)
        parts[a, b] = result
    names = list(CAMERAS)
    refined = {}
    for pair, lag_s in coarse_lags(names, parts, limits_of(0.5)).items():
        refined[pair] = parts[pair]
        while not refined[pair].is_refined:
            refined[pair] = refined[pair].refined_further(lag_s)
    assert len(refined) == len(whole) >= 2
    assert lags_between(names, {**parts, **refined}, limits_of(0.5)) == lags_between(names, whole, limits_of(0.5))


def test_cameras_at_one_place_cannot_be_compared():
    camera = CAMERAS["cam01"]
    seen = [outline_of(camera, mask_of(camera, 5.0), 0.0)] * 3
    progress = advance(PairProgress((camera, camera), (seen, seen), REACH_S))
    assert progress.ended
    assert compared(progress) is None
