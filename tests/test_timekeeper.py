"""The integrator beside a tracker: it keeps clock and log, and says so."""

from dataclasses import replace

from common import messages as m
from common.bus.local import LocalNetwork
from common.bus.protocol import Envelope, RoundTrip, Tick
from common.runtime.clock import ManualClock
from common.runtime.rig import demo_rig
from common.runtime.service import run
from common.topics import HEALTH
from services.integrator.shell import timekeeper_service

RIG = replace(demo_rig(), method="hybrid")


class Steps:
    """True after so many looks."""

    def __init__(self, count: int) -> None:
        self._left = count

    def __call__(self) -> bool:
        self._left -= 1
        return self._left < 0


def test_it_answers_the_clock_and_tells_what_it_is_for() -> None:
    network = LocalNetwork("demo", ManualClock(10**15))
    bus, other = network.bus(), network.bus()
    other.subscribe(HEALTH)
    assert run(timekeeper_service(RIG), bus, network.clock, stopped=Steps(3)) == 0
    other.ask_clock()
    events = [other.receive(), other.receive()]
    health = next(event.message for event in events if isinstance(event, Envelope))
    assert isinstance(health, m.Health)
    assert (health.service, health.id) == ("integrator", "main")
    assert health.state == "method hybrid: keeps clock and log, the tracker finds the pose"
    assert any(isinstance(event, RoundTrip) for event in events)


def test_nothing_that_comes_makes_it_speak() -> None:
    service = timekeeper_service(RIG)
    assert service.subscriptions == ()
    assert service.step(service.setup, service.state, Tick(1)) == (None, [])
