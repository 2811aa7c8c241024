"""The integrator converts capture times to its own clock, and reports a wrong clock of a viewer."""

from tests.support.built_messages import built
from tests.support.simulated_cameras import paper_cameras
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.bus.protocol import Envelope
from zenocap.common.topics import HEALTH, SIGHTING
from zenocap.services.integrator.states import integrator_setup
from zenocap.services.integrator.step import counts, describe, initial_state, step

FRAME_NS = 66_666_667


def health(offset_ns: int) -> Envelope:
    message = built(m.Health, captured_ns=1, id="2", rate=15.0, clock_offset_ns=offset_ns, clock_error_ns=100_000)
    return Envelope("", HEALTH, message, 1)


def sighting(viewer: str, captured_ns: int) -> Envelope:
    message = built(m.Sighting, frame=3, captured_ns=captured_ns, viewer=viewer, height=0.3, view="flank", score=0.0)
    return Envelope("", SIGHTING, message, captured_ns)


def test_frames_of_a_viewer_with_a_wrong_clock_are_paired_and_the_clock_is_reported() -> None:
    setup = integrator_setup(TEN_PARTS, dict(zip("12", paper_cameras(), strict=True)), FRAME_NS)
    state, _ = step(setup, initial_state(setup), health(500_000_000))
    state, first_reply = step(setup, state, sighting("1", 10**9))
    state, answer = step(setup, state, sighting("2", 10**9 + 500_000_000))
    assert first_reply == []
    assert [type(message) for message in answer] == [m.Assignment]
    assert "viewer 2" in state.warnings["2"]
    state, _ = step(setup, state, health(1_000))
    assert state.warnings == {}


def test_rejected_messages_are_counted_by_kind() -> None:
    setup = integrator_setup(TEN_PARTS, dict(zip("12", paper_cameras(), strict=True)), FRAME_NS)
    state = initial_state(setup)
    for captured_ns in (10**9, 10**9):
        state, _ = step(setup, state, sighting("1", captured_ns))
    assert counts(state) == {"sighting_doubled": 1}
    assert "waiting" in describe(state)
