"""Cost of the messages on the network: codec and recording."""

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from tests.support.built_messages import built
from zenocap.common import messages as m
from zenocap.common.codec import decode, encode

ANGLES = {f"{joint}.{axis}": 0.1 for joint in ("neck", "shoulder", "elbow", "hip", "knee", "navel") for axis in "xyz"}
BOTH = {"scores": {"1": 0.7, "2": 0.6}, "views": {"1": "facade", "2": "flank"}}
MESSAGES = [
    built(m.Sighting, captured_ns=10**18),
    built(m.UniversalBap, captured_ns=10**18, angles=ANGLES, **BOTH),
    built(m.Silhouette, captured_ns=10**18, size=(640, 480), region=(0, 0, 640, 480), data=bytes(range(256)) * 80),
]
of_each_kind = pytest.mark.parametrize("message", MESSAGES, ids=lambda message: type(message).__name__)


@of_each_kind
def test_encode(benchmark: BenchmarkFixture, message: m.Message) -> None:
    assert len(benchmark(encode, message)) > 50


@of_each_kind
def test_decode(benchmark: BenchmarkFixture, message: m.Message) -> None:
    assert benchmark(decode, encode(message), type(message)) == message
