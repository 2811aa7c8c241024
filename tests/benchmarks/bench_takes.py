"""Writing, reading and recovering a take of the real mixture of messages: `make benchmark`.

Budget: 20 000 messages a second.  `python -m tests.evaluation.logging` has the figures at two working sizes.
"""

from pathlib import Path

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from common.bus.protocol import Envelope
from common.take.reading import Take, envelope
from tests.evaluation.logging import logged, recovered, write
from tests.evaluation.mixture import mixture

COUNT = 2000


@pytest.fixture(scope="module")
def said() -> list[Envelope]:
    return mixture()[:COUNT]


@pytest.fixture
def take(said: list[Envelope], tmp_path: Path) -> Path:
    write(tmp_path / "take.mcap", said)
    return tmp_path / "take.mcap"


def test_write_2000_messages(benchmark: BenchmarkFixture, said: list[Envelope], tmp_path: Path) -> None:
    assert benchmark.pedantic(write, (tmp_path / "take.mcap", said), rounds=5) == COUNT


def test_log_2000_messages(benchmark: BenchmarkFixture, said: list[Envelope], tmp_path: Path) -> None:
    assert benchmark.pedantic(logged, (tmp_path / "take.mcap", said), rounds=5) == COUNT


def test_read_2000_messages(benchmark: BenchmarkFixture, take: Path) -> None:
    assert benchmark(lambda: sum(1 for _ in Take(take).messages())) == COUNT


def test_read_and_decode_2000_messages(benchmark: BenchmarkFixture, take: Path) -> None:
    assert benchmark(lambda: sum(envelope(each) is not None for each in Take(take).messages())) == COUNT


def test_recover_2000_messages(benchmark: BenchmarkFixture, take: Path) -> None:
    assert benchmark.pedantic(recovered, (take,), rounds=5) == COUNT
