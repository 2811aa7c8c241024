"""Time per particle of the prior's kernels, called from Python, for the built-in priors."""

from collections.abc import Callable

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from zenocap.common.arrays import Floats
from zenocap.common.rig.tracker import find_prior
from zenocap.services.tracker.prior.file import read_prior
from zenocap.services.tracker.prior.sampling import CompiledPrior, assign, prior_distance, propose


@pytest.mark.parametrize("kind", ["walking", "general"])
def test_propose(benchmark: BenchmarkFixture, kind: str) -> None:
    prior = read_prior(find_prior(kind))
    normals, out = np.zeros(prior.dimensions), np.empty(len(prior.names))
    region = benchmark(propose, prior.compiled, 0, prior.centres[1], 0.5, normals, out)
    assert 0 <= region < prior.regions


@pytest.mark.parametrize("measure", [assign, prior_distance], ids=["assign", "distance"])
@pytest.mark.parametrize("kind", ["walking", "general"])
def test_evaluate_a_pose(benchmark: BenchmarkFixture, kind: str, measure: Callable[[CompiledPrior, Floats], float]) -> None:
    prior = read_prior(find_prior(kind))
    assert np.isfinite(benchmark(measure, prior.compiled, prior.centres[1]))
