"""What people ask for changes what services say."""

from dataclasses import replace

from test_tracker_step import instant
from test_tracker_step import play as track
from tracker_stand_in import stand_in, tracker_setup
from two_view_run import EPOCH_NS, FRAME_NS, Run, envelope, film, integrator_setup, kind_of

from common import messages as m
from common.topics import REQUEST, service_at
from services.integrator import step as integrator
from services.tracker import step as tracker
from services.viewer.states import MeasuringBody, Tracking

MEASURE = m.Request(frame=0, captured_ns=EPOCH_NS, what="measure")
FRAMES = 46  # the initial posture is over, arms are going down


def measured() -> Run:
    run = Run()
    for frames in film(FRAMES):
        run.see(frames)
    assert len(kind_of(run.said, m.UniversalBdp)) == 1
    assert all(isinstance(state, Tracking) for state in run.viewers.values())
    return run


def ask(run: Run, request: m.Request) -> None:
    run.integrator, answers = integrator.step(integrator_setup(), run.integrator, envelope(request))
    assert answers == []


def test_the_body_is_measured_anew_when_the_initial_posture_is_shown_again() -> None:
    run = measured()
    ask(run, MEASURE)
    assert integrator.describe(run.integrator) == "waiting for the initial posture in both views"
    measuring = False
    for k, frames in enumerate(film(FRAMES)[12:]):
        frame = FRAMES + k
        run.see({id: replace(f, frame=frame, captured_ns=EPOCH_NS + frame * FRAME_NS) for id, f in frames.items()})
        measuring |= all(isinstance(state, MeasuringBody) for state in run.viewers.values())
    assert measuring
    bodies = kind_of(run.said, m.UniversalBdp)
    assert len(bodies) == 2
    assert all(isinstance(state, Tracking) for state in run.viewers.values())


def test_who_is_asked_for_a_take_goes_on_as_before() -> None:
    run = measured()
    before = run.integrator
    for what in ("record", "stop_recording"):
        ask(run, m.Request(frame=0, captured_ns=EPOCH_NS, what=what))
    assert run.integrator is before


def test_the_tracker_forgets_the_person_too() -> None:
    setup = tracker_setup()
    with stand_in():
        state, _ = track([message for k in range(4) for message in instant(k)])
        assert state.pose is not None
        state, messages = tracker.step(setup, state, envelope(MEASURE))
        assert messages == []
        assert state.pose is None
        assert state.track == tracker.initial_state(setup).track


def test_a_request_belongs_to_nobody_so_that_a_replay_need_not_stand_in_for_who_asked() -> None:
    assert service_at(REQUEST.at("demo")) is None
