"""Input trace: the ordered inputs of a step."""

from dataclasses import dataclass
from unittest.mock import Mock

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.built_messages import built
from tests.support.foxglove_reader import in_envelope
from zenocap.common.bus.local import LocalNetwork
from zenocap.common.bus.protocol import Alive, Tick
from zenocap.common.messages import Handled, Health
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.runtime.input_trace import FULL, Trace, name_and_time
from zenocap.common.runtime.service import Runner, Service
from zenocap.common.topics import HANDLED


@dataclass(frozen=True)
class Picture:
    frame: int
    captured_ns: int


@pytest.fixture
def network() -> LocalNetwork:
    return LocalNetwork("test", ManualClock(9))


@pytest.mark.parametrize(
    ("event", "name_and_time_of_it"),
    [
        (in_envelope(built(Health, captured_ns=5), "test"), ("zenocap/test/viewer/1/health", 5)),
        (Picture(3, 7), ("frame", 7)),
        (Tick(8), ("tick", 8)),
        (Alive("viewer", "1", True, 4), ("alive/viewer/1", 4)),
        (Alive("viewer", "1", False, 4), ("gone/viewer/1", 4)),
    ],
    ids=["message", "picture", "tick", "alive", "gone"],
)
def test_every_kind_of_event_has_a_name_and_a_time(event: object, name_and_time_of_it: tuple[str, int]) -> None:
    assert name_and_time(event) == name_and_time_of_it


@given(st.lists(st.tuples(st.booleans(), st.integers(0, 10**18)), max_size=50), st.integers(1, 9))
def test_joined_reports_equal_the_events_in_order(events: list[tuple[bool, int]], every: int) -> None:
    trace = Trace("viewer", "1")
    reports = []
    for k, (tick, time_ns) in enumerate(events):
        trace.add(Tick(time_ns) if tick else Picture(k, time_ns))
        if k % every == 0:
            reports.append(trace.report(k))
    reports.append(trace.report(len(events)))
    found = []
    for number, report in enumerate(report for report in reports if report is not None):
        assert (report.frame, report.first) == (number, len(found))
        found += [(report.keys[index] == "tick", time_ns) for index, time_ns in report.events]
    assert found == events


def test_there_is_no_report_without_events() -> None:
    assert Trace("viewer", "1").report(5) is None


def test_a_runner_publishes_full_traces_at_once_and_the_rest_on_request(network: LocalNetwork) -> None:
    reader = network.bus()
    reader.subscribe(HANDLED)
    service: Service[None, int, Picture] = Service("counter", "1", None, lambda: 0, lambda _, state, event: (state + 1, ()))
    runner = Runner(service, network.bus(), network.clock)
    for k in range(FULL + 3):
        runner.handle(Picture(k, 100 + k))
    runner.report_handled()
    runner.report_handled()
    published = []
    while (event := reader.receive()) is not None:
        published.append(event.message)  # type: ignore[union-attr]
    assert all(isinstance(message, Handled) for message in published)
    assert [(message.first, len(message.events)) for message in published] == [(0, FULL), (FULL, 3)]
    assert published[1].keys == ["frame"]
    assert published[1].events[-1] == (0, 100 + FULL + 2)


def test_an_event_of_a_failed_step_is_in_the_trace(network: LocalNetwork) -> None:
    reader = network.bus()
    reader.subscribe(HANDLED)
    failing = Mock(side_effect=ValueError("no"))
    runner = Runner(Service("counter", "1", None, lambda: 0, failing), network.bus(), network.clock)
    runner.handle(Tick(5))
    runner.report_handled()
    assert reader.receive().message.events == [(0, 5)]
