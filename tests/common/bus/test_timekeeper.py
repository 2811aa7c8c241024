"""Integrator of a tracker rig: provides clock and log, and publishes its health."""

from dataclasses import replace

from zenocap.common import messages as m
from zenocap.common.bus.local import LocalNetwork
from zenocap.common.bus.protocol import Envelope, RoundTrip, Tick
from zenocap.common.rig.rig import demo_rig
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.runtime.service import run
from zenocap.common.topics import CAMERA_DELAYS, FRAME_RATE, HEALTH, SILHOUETTE, TRACKER_DETAIL
from zenocap.services.integrator.shell import timekeeper_service

RIG = replace(demo_rig("two-view"), method="hybrid")


def test_timekeeper_answers_clock_queries_and_publishes_its_health() -> None:
    network = LocalNetwork("demo", ManualClock(10**15))
    bus, other = network.bus(), network.bus()
    other.subscribe(HEALTH)
    stopped = iter([False, False, False, True])
    assert run(timekeeper_service(RIG), bus, network.clock, stopped=lambda: next(stopped)) == 0
    other.query_clock()
    events = [other.receive(), other.receive()]
    health = next(event.message for event in events if isinstance(event, Envelope))
    assert (health.service, health.id) == ("integrator", "main")
    assert health.phase is m.Phase.RUNNING
    assert any(isinstance(event, RoundTrip) for event in events)


def test_timekeeper_publishes_the_full_frame_rate_and_nothing_else_while_no_viewer_reports_losses() -> None:
    service = timekeeper_service(RIG)
    assert {subscription.topic for subscription in service.subscriptions} == {
        HEALTH, FRAME_RATE, TRACKER_DETAIL, CAMERA_DELAYS, SILHOUETTE,
    }  # fmt: skip
    state, published = service.initial(), []
    for second in range(1, 10):
        state, messages = service.step(service.setup, state, Tick(second * 10**9))
        published += messages
    rate, *detail = published
    assert (rate.keep, rate.of) == (1, 1)
    assert [type(message) for message in detail] == [m.TrackerDetail] * service.setup.rate.has_tracker
