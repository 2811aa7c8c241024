"""Cost of the messages on the network: codec and recording."""

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from zenocap.common import messages as m
from zenocap.common.codec import decode, encode

ANGLES = {f"{joint}.{axis}": 0.1 for joint in ("neck", "shoulder", "elbow", "hip", "knee", "navel") for axis in "xyz"}
BAP = m.UniversalBap(
    frame=1, captured_ns=10**18, position=(0.0, 1.0, 0.0), angles=ANGLES, scores={"1": 0.7, "2": 0.6},
    views={"1": "facade", "2": "flank"}, stale=[], lost=[],
)  # fmt: skip
SIGHTING_MESSAGE = m.Sighting(
    frame=1, captured_ns=10**18, viewer="1", present=True, x=0.1, y=0.2, height=1.0, width=0.3, view="facade", score=0.5
)
MASK = m.Silhouette(
    frame=1, captured_ns=10**18, viewer="1", size=(640, 480), region=(0, 0, 640, 480), data=bytes(range(256)) * 80
)


@pytest.mark.parametrize("message", [SIGHTING_MESSAGE, BAP, MASK], ids=lambda message: type(message).__name__)
def test_encode(benchmark: BenchmarkFixture, message: m.Message) -> None:
    assert len(benchmark(encode, message)) > 50


@pytest.mark.parametrize("message", [SIGHTING_MESSAGE, BAP, MASK], ids=lambda message: type(message).__name__)
def test_decode(benchmark: BenchmarkFixture, message: m.Message) -> None:
    assert benchmark(decode, encode(message), type(message)) == message
