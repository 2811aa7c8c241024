"""Effect of user requests on the steps of the services."""

from dataclasses import replace

import pytest

from tests.services.tracker.test_step import instant
from tests.services.tracker.test_step import play as track
from tests.support.tracker_stand_in import stand_in, tracker_setup
from tests.support.two_view_run import EPOCH_NS, FRAME_NS, Run, envelope, film, integrator_setup, messages_of_kind
from zenocap.common import messages as m
from zenocap.common.topics import REQUEST, service_at
from zenocap.services.integrator import step as integrator
from zenocap.services.tracker import step as tracker
from zenocap.services.viewer.two_view.states import MeasuringBody, TrackingBody

MEASURE = m.Request(frame=0, captured_ns=EPOCH_NS, what="measure")
FRAMES = 46  # the T-pose is over, the arms move down


def measured() -> Run:
    run = Run()
    for frames in film(FRAMES):
        run.process(frames)
    assert len(messages_of_kind(run.published, m.UniversalBdp)) == 1
    assert all(isinstance(state, TrackingBody) for state in run.viewers.values())
    return run


def send_request(run: Run, request: m.Request) -> None:
    run.integrator, answers = integrator.step(integrator_setup(), run.integrator, envelope(request))
    assert answers == []


@pytest.mark.nightly
def test_the_body_is_measured_again_after_a_measure_request_and_recording_requests_change_nothing() -> None:
    run = measured()
    before = run.integrator
    for what in ("record", "stop_recording"):
        send_request(run, m.Request(frame=0, captured_ns=EPOCH_NS, what=what))
    assert run.integrator is before
    send_request(run, MEASURE)
    assert integrator.describe(run.integrator) == "waiting for the T-pose in both views"
    measuring = False
    for k, frames in enumerate(film(FRAMES)[12:]):
        frame = FRAMES + k
        run.process({id: replace(f, frame=frame, captured_ns=EPOCH_NS + frame * FRAME_NS) for id, f in frames.items()})
        measuring |= all(isinstance(state, MeasuringBody) for state in run.viewers.values())
    assert measuring
    bodies = messages_of_kind(run.published, m.UniversalBdp)
    assert len(bodies) == 2
    assert all(isinstance(state, TrackingBody) for state in run.viewers.values())


def test_a_measure_request_resets_the_tracker() -> None:
    setup = tracker_setup()
    with stand_in():
        state, _ = track([message for k in range(4) for message in instant(k)])
        assert state.pose is not None
        state, messages = tracker.step(setup, state, envelope(MEASURE))
        assert messages == []
        assert state.pose is None
        assert state.track == tracker.initial_state(setup).track


def test_the_key_of_a_request_names_no_service() -> None:
    assert service_at(REQUEST.at("demo")) is None
