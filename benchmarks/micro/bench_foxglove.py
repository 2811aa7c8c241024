"""Cost of the Foxglove channels, by kind of message."""

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from tests.support.built_messages import built, silhouette
from tests.support.foxglove_reader import in_envelope
from tests.support.walkers import walker
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.proportions import average_lengths, body_from_lengths
from zenocap.common.conversion import angles_by_name, body_of
from zenocap.common.formats.foxglove.converter import FoxgloveConverter

VIEWERS = [str(k) for k in range(8)]
ANGLES = angles_by_name(TEN_PARTS, TEN_PARTS.neutral)
BODY = body_from_lengths(TEN_PARTS, average_lengths(1.75))
BDP = m.UniversalBdp(frame=0, captured_ns=0, body=body_of(TEN_PARTS, BODY), ratio=1.0)
LIMB = m.LimbMatch(score=0.7, visible=0.6, matchings=[7, 8])
LIMBS = dict.fromkeys(("right_arm", "left_arm", "right_leg", "left_leg"), LIMB)


def ragged(size: tuple[int, int]) -> m.Silhouette:
    """Silhouette of a person with a ragged edge, as from a camera."""
    return silhouette("1", 1, 0, next(walker(1, 1, size).film("cam01", [1.0])))


def converter() -> FoxgloveConverter:
    made = FoxgloveConverter(TEN_PARTS, "r")
    made.convert(in_envelope(BDP, "r"))
    return made


MESSAGES: dict[str, m.Message] = {
    "UniversalBap": built(
        m.UniversalBap, angles=ANGLES, scores=dict.fromkeys(VIEWERS, 0.7), views=dict.fromkeys(VIEWERS, "facade")
    ),
    "Silhouette 160x120": ragged((160, 120)),
    "Silhouette 640x480": ragged((640, 480)),
    "Sighting": built(m.Sighting, turns=[-1.5] * 5, arms=[-2.5] * 12, legs=[-3.5] * 12),
    "PartialBap": built(m.PartialBap, angles=dict(list(ANGLES.items())[:11]), limbs=LIMBS),
}


@pytest.mark.parametrize("message", MESSAGES.values(), ids=MESSAGES)
def test_convert(benchmark: BenchmarkFixture, message: m.Message) -> None:
    envelope = in_envelope(message, "r")
    assert isinstance(benchmark(converter().convert, envelope), list)
