"""What a particle's share of the prior costs, called from Python, for the shipped priors: microseconds."""

from collections.abc import Callable

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from common.body.anatomy import Floats
from services.tracker.prior.file import read_prior
from services.tracker.prior.sampling import assign, distance, log_density, propose
from services.tracker.prior.shipped import find_prior
from services.tracker.prior.tables import Tables


@pytest.mark.parametrize("kind", ["walking", "general"])
def test_proposing(benchmark: BenchmarkFixture, kind: str) -> None:
    prior = read_prior(find_prior(kind))
    normals, out = np.zeros(prior.dimensions), np.empty(len(prior.names))
    region = benchmark(propose, prior.tables, 0, prior.centres[1], 0.5, normals, 1.0, out)
    assert 0 <= region < prior.regions


@pytest.mark.parametrize("measure", [assign, distance, log_density], ids=["assign", "distance", "log_density"])
@pytest.mark.parametrize("kind", ["walking", "general"])
def test_measuring_a_pose(benchmark: BenchmarkFixture, kind: str, measure: Callable[[Tables, Floats], float]) -> None:
    prior = read_prior(find_prior(kind))
    assert np.isfinite(benchmark(measure, prior.tables, prior.centres[1]))
