"""Forward-backward pass against hmmlearn; `tests/test_papers.py` enumerates all paths."""

import numpy as np
import pytest
from hmmlearn.hmm import GaussianHMM
from scipy.stats import multivariate_normal

from zenocap.common.arrays import Floats
from zenocap.services.tracker.prior.forward_backward import expectation


def chain(rng: np.random.Generator, states: int) -> Floats:
    return rng.dirichlet(np.ones(states), size=states)


def test_expectation_equals_hmmlearn() -> None:
    rng = np.random.default_rng(0)
    model = GaussianHMM(n_components=4, covariance_type="full", init_params="")
    model.startprob_, model.transmat_ = np.full(4, 0.25), chain(rng, 4)
    model.means_, model.covars_ = rng.normal(size=(4, 3)), np.stack([np.eye(3) * s for s in (0.5, 1.0, 1.5, 2.0)])
    poses, _ = model.sample(300, random_state=1)
    densities = [multivariate_normal(*one).logpdf(poses) for one in zip(model.means_, model.covars_, strict=True)]
    found = expectation(model.transmat_, np.stack(densities, axis=1))
    assert found.log_likelihood == pytest.approx(model.score(poses), rel=1e-9)
    assert np.allclose(found.gamma, model.predict_proba(poses), atol=1e-9)


def test_error_names_the_unreachable_frame() -> None:
    never = np.array([[1.0, 0.0], [1.0, 0.0]])
    log_densities = np.array([[0.0, 0.0], [-np.inf, 0.0]])
    with pytest.raises(ValueError, match="frame 1: no state sequence"):
        expectation(never, log_densities)
