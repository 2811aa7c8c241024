"""Distances against plain numpy; proposals are in `tests/test_papers.py`.  [Hybrid Eq. 24-28]"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.prior_cases import D, drawn, known_prior, reconstruction_error
from zenocap.services.tracker.prior import model
from zenocap.services.tracker.prior.sampling import assign, prior_distance

PRIOR = known_prior()
SEEDS = st.integers(0, 2**32 - 1)


@given(SEEDS, st.sampled_from([0.05, 0.5, 3.0]))
def test_assignment_and_distance_are_those_of_the_arrays(seed: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    pose = PRIOR.centres[rng.integers(4)] + rng.normal(scale=spread, size=D)
    assert assign(PRIOR.compiled, pose) == model.assign(PRIOR, pose[None])[0]
    assert prior_distance(PRIOR.compiled, pose) == pytest.approx(reconstruction_error(PRIOR, pose[None]), rel=1e-6)


def test_training_poses_are_near() -> None:
    rng = np.random.default_rng(5)
    familiar, _ = drawn(PRIOR, 100, rng)
    unfamiliar = rng.normal(scale=0.5, size=(100, D))
    near, far = ([prior_distance(PRIOR.compiled, x) for x in poses] for poses in (familiar, unfamiliar))
    assert max(near) < min(far)
