"""Writing, reading and recovering a take with a realistic mixture of messages: `make benchmark`.

Budget: 20 000 messages a second.  `python -m benchmarks.logging` has the figures at two working sizes.
"""

from pathlib import Path

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from benchmarks.cases.speed.log import logged, recovered, write
from benchmarks.cases.takes.mixture import mixture
from zenocap.common.bus.protocol import Envelope
from zenocap.common.recording.reader import Take, envelope

COUNT = 2000


@pytest.fixture(scope="module")
def messages() -> list[Envelope]:
    return mixture()[:COUNT]


@pytest.fixture
def take(messages: list[Envelope], tmp_path: Path) -> Path:
    write(tmp_path / "take.mcap", messages)
    return tmp_path / "take.mcap"


def test_write_2000_messages(benchmark: BenchmarkFixture, messages: list[Envelope], tmp_path: Path) -> None:
    assert benchmark.pedantic(write, (tmp_path / "take.mcap", messages), rounds=5) == COUNT


def test_log_2000_messages(benchmark: BenchmarkFixture, messages: list[Envelope], tmp_path: Path) -> None:
    assert benchmark.pedantic(logged, (tmp_path / "take.mcap", messages), rounds=5) == COUNT


def test_read_2000_messages(benchmark: BenchmarkFixture, take: Path) -> None:
    assert benchmark(lambda: sum(1 for _ in Take(take).messages())) == COUNT


def test_read_and_decode_2000_messages(benchmark: BenchmarkFixture, take: Path) -> None:
    assert benchmark(lambda: sum(envelope(each) is not None for each in Take(take).messages())) == COUNT


def test_recover_2000_messages(benchmark: BenchmarkFixture, take: Path) -> None:
    assert benchmark.pedantic(recovered, (take,), rounds=5) == COUNT
