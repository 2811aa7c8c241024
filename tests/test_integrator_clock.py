"""The integrator brings capture times to its own clock, and says when a viewer's clock is off."""

from common import messages as m
from common.body.anatomy import TEN_PARTS
from common.bus.protocol import Envelope
from common.topics import HEALTH, SIGHTING
from services.integrator.step import counts, describe, initial_state, integrator_setup, step
from tests.actor_cameras import paper_cameras

FRAME_NS = 66_666_667


def health(offset_ns: int) -> Envelope:
    message = m.Health(
        frame=0, captured_ns=1, service="viewer", id="2", state="", rate=15.0, stages_ms={}, counts={},
        clock_offset_ns=offset_ns, clock_error_ns=100_000,
    )  # fmt: skip
    return Envelope("", HEALTH, message, 1)


def sighting(viewer: str, captured_ns: int) -> Envelope:
    message = m.Sighting(
        frame=3, captured_ns=captured_ns, viewer=viewer, present=True, x=0.0, y=0.0, height=0.3, width=0.3, view="flank",
        score=0.0,
    )  # fmt: skip
    return Envelope("", SIGHTING, message, captured_ns)


def test_a_clock_that_is_half_a_second_off_pairs_all_the_same_and_is_told() -> None:
    setup = integrator_setup(TEN_PARTS, dict(zip("12", paper_cameras(), strict=True)), FRAME_NS)
    state, _ = step(setup, initial_state(setup), health(500_000_000))
    state, none = step(setup, state, sighting("1", 10**9))
    state, answer = step(setup, state, sighting("2", 10**9 + 500_000_000))
    assert none == []
    assert [type(message) for message in answer] == [m.Assignment]
    assert "viewer 2" in state.warnings["2"]
    state, _ = step(setup, state, health(1_000))
    assert state.warnings == {}


def test_what_came_wrong_is_counted_by_kind() -> None:
    setup = integrator_setup(TEN_PARTS, dict(zip("12", paper_cameras(), strict=True)), FRAME_NS)
    state = initial_state(setup)
    for captured_ns in (10**9, 10**9):
        state, _ = step(setup, state, sighting("1", captured_ns))
    assert counts(state) == {"sighting_doubled": 1}
    assert "waiting" in describe(state)
