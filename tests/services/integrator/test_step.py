"""The integrator's step, driven by messages of ideal viewers."""

from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from msgspec.structs import replace

from tests.support.built_messages import built
from tests.support.perfect_viewers import (
    FIRST,
    HEIGHT,
    HIPS,
    INITIAL_MESSAGES,
    LENGTHS,
    SETUP,
    TRACKED,
    measured,
    partial_bap,
    partial_bdp,
    play,
    sighting,
)
from tests.support.two_view_run import EPOCH_NS, FRAME_NS, VIEWERS, envelope, integrator_setup, messages_of_kind
from tests.support.two_view_scene import angles, degrees_between
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.segments import limb_directions
from zenocap.common.bus.protocol import Alive, Tick
from zenocap.common.codec import decode, encode
from zenocap.common.conversion import bdp_of
from zenocap.services.integrator import step as integrator
from zenocap.services.integrator.parameters import INSTANTS_OF_BODY, RECOVERY_TICKS
from zenocap.services.integrator.states import IntegratorState
from zenocap.services.integrator.two_view.perspective import scaling_factor

assignments, baps = partial(messages_of_kind, kind=m.Assignment), partial(messages_of_kind, kind=m.UniversalBap)
NEW = integrator.initial_state(SETUP)


def views_of(assignment: m.Assignment) -> dict[str, str]:
    return {viewer: assigned.view for viewer, assigned in assignment.views.items()}


def test_the_initial_posture_gives_one_body_and_one_pose() -> None:
    kinds = [type(message) for message in INITIAL_MESSAGES]
    assert kinds == [m.Assignment] * INSTANTS_OF_BODY + [m.UniversalBdp, m.UniversalBap]
    universal, bap = INITIAL_MESSAGES[-2:]
    torso = bdp_of(TEN_PARTS, universal.body).sizes[TEN_PARTS.index["torso"]]
    assert 2 * torso[2] == pytest.approx(LENGTHS["torso_depth"])
    assert universal.ratio == pytest.approx(1.0)
    np.testing.assert_allclose(bap.position, HIPS, atol=1e-6)
    assert bap.angles["right_shoulder.z"] == pytest.approx(np.pi / 2)
    assert integrator.describe(TRACKED) == "tracking"


def test_the_first_assignments_have_the_position_and_the_front_viewer() -> None:
    for assignment in assignments(INITIAL_MESSAGES):
        np.testing.assert_allclose(assignment.position, HIPS, atol=1e-6)
        assert not assignment.tracking
        assert views_of(assignment) == {"1": "facade", "2": "flank"}
        assert assignment.yaw == pytest.approx(0.0, abs=1e-3)
        for viewer, answer in assignment.views.items():
            assert answer.scale == pytest.approx(scaling_factor(SETUP.cameras[viewer], HIPS))


def test_the_viewer_that_sees_the_stretched_arms_is_the_front_viewer() -> None:
    _, (first,) = play(NEW, sighting("1", 0, view="flank"), sighting("2", 0, view="facade"))
    assert views_of(first) == {"1": "flank", "2": "facade"}
    assert first.yaw == pytest.approx(-np.pi / 2, abs=1e-3)  # towards camera 2 on -X
    _, (unclear,) = play(NEW, sighting("1", 0, view="flank"), sighting("2", 0, view="flank"))
    assert views_of(unclear) == {"1": "facade", "2": "flank"}  # as before


def test_no_body_is_measured_without_both_viewers() -> None:
    state, published = play(NEW, *(sighting("1", frame) for frame in range(8)))
    assert published == []
    state, published = play(state, sighting("1", 9), sighting("2", 9, present=False))
    assert published == []
    assert integrator.describe(state) == "waiting for the T-pose in both views"


def not_measured(frames: int, scales: Callable[[int], tuple[float, float]]) -> IntegratorState:
    """State after T-poses that give no body.  scales: factors on the lengths that the viewers measure, by frame."""
    state = NEW
    for frame in range(frames):
        bodies = (partial_bdp(viewer, frame, scale) for viewer, scale in zip(VIEWERS, scales(frame), strict=True))
        state, published = play(state, *(sighting(viewer, frame) for viewer in VIEWERS), *bodies)
        assert messages_of_kind(published, m.UniversalBdp) == []
    return state


def test_a_person_who_moves_is_not_measured() -> None:
    not_measured(3 * INSTANTS_OF_BODY, lambda frame: (1.0 + 0.05 * (frame % 2),) * 2)


def test_the_health_text_reports_viewers_that_disagree_on_the_height() -> None:
    assert "differ by 40%" in integrator.describe(not_measured(INSTANTS_OF_BODY, lambda _: (1.0, 1.4)))


def test_a_known_height_needs_no_initial_posture() -> None:
    setup = integrator_setup(HEIGHT)
    state, published = integrator.initial_state(setup), []
    for viewer in VIEWERS:
        state, published = integrator.step(setup, state, envelope(sighting(viewer, 0)))
    assert [type(message) for message in published] == [m.UniversalBdp, m.UniversalBap]


def test_sightings_give_an_assignment_and_partial_baps_a_universal_bap_while_tracking() -> None:
    moved = HIPS + np.array([0.05, -0.01, 0.04])
    state, published = play(TRACKED, *(sighting(v, FIRST, moved) for v in VIEWERS))
    (assignment,) = published
    assert assignment.tracking
    np.testing.assert_allclose(assignment.position, moved, atol=1e-6)
    assert {v: (a.frame, a.stale) for v, a in assignment.views.items()} == {"1": (FIRST, False), "2": (FIRST, False)}
    pose = angles(right_shoulder_z=120, left_hip_x=20)
    _, published = play(state, *(partial_bap(v, FIRST, pose) for v in VIEWERS))
    (bap,) = published
    assert bap.position == assignment.position
    found = np.array([bap.angles[name] for name in TEN_PARTS.angles])
    off = degrees_between(limb_directions(TEN_PARTS, found), limb_directions(TEN_PARTS, pose))
    assert np.max(off) < 5
    assert bap.scores == {"1": 0.8, "2": 0.8}
    assert bap.stale == []


def test_a_missing_viewer_is_stale_and_tracking_continues_with_the_other_one() -> None:
    state, published = TRACKED, []
    for frame in range(FIRST, FIRST + 4):
        state, more = play(state, sighting("1", frame))
        published += more
    assert [a.views["2"].stale for a in assignments(published)] == [True] * 3, "the next sighting ends each wait"
    assert all(not a.views["1"].stale for a in assignments(published))
    assert [a.views["2"].frame for a in assignments(published)] == [FIRST - 1] * 3
    state, more = play(state, partial_bap("1", FIRST, angles()), partial_bap("1", FIRST + 1, angles()))
    assert baps(more)[0].stale == ["2"]
    for frame in range(FIRST + 4, FIRST + 14):
        state, _ = play(state, sighting("1", frame))
    assert integrator.describe(state) == "tracking, without viewer 2"
    state, published = play(state, *(sighting(v, FIRST + 20) for v in VIEWERS), *(sighting(v, FIRST + 21) for v in VIEWERS))
    assert [a.stale for a in assignments(published)[-1].views.values()] == [False, False], "the viewer is used again"
    assert integrator.describe(state) == "tracking"


def test_a_viewer_without_a_person_in_view_is_stale() -> None:
    _, published = play(TRACKED, sighting("1", FIRST), sighting("2", FIRST, present=False))
    assert {v: a.stale for v, a in assignments(published)[0].views.items()} == {"1": False, "2": True}


def test_empty_views_give_no_assignment_and_keep_the_body() -> None:
    state, published = play(TRACKED, *(sighting(v, FIRST, present=False) for v in VIEWERS))
    assert published == []
    assert state.person is not None
    _, published = play(state, *(sighting(v, FIRST + 1) for v in VIEWERS))
    assert len(assignments(published)) == 1


def test_duplicate_sightings_and_baps_are_counted_and_answered_once() -> None:
    one, two = (sighting(v, FIRST) for v in VIEWERS)
    state, published = play(TRACKED, one, one, two, two, one)
    assert len(published) == 1
    first, second = (partial_bap(v, FIRST, angles()) for v in VIEWERS)
    state, published = play(state, first, first, second, second)
    assert len(published) == 1
    assert (integrator.counts(state)["sighting_doubled"], integrator.counts(state)["bap_doubled"]) == (3, 2)


def test_partial_baps_without_an_assignment_are_ignored() -> None:
    assert play(TRACKED, *(partial_bap(v, FIRST + 50, angles()) for v in VIEWERS))[1] == []


def test_an_unknown_viewer_is_counted() -> None:
    state, published = play(TRACKED, built(m.Sighting, captured_ns=EPOCH_NS, viewer="9", present=False))
    assert (published, integrator.counts(state)["sighting_unknown"]) == ([], 1)


def test_other_events_do_not_change_the_state() -> None:
    health = built(m.Health, captured_ns=1, service="tracker")
    for event in (envelope(health), envelope(INITIAL_MESSAGES[0]), Alive("viewer", "1", True, 3)):
        state, published = integrator.step(SETUP, TRACKED, event)
        assert state is TRACKED
        assert published == []


def test_capture_times_are_corrected_by_the_clock_offset_in_health_and_a_wrong_clock_is_reported() -> None:
    ahead_ns = 5 * FRAME_NS
    health = built(m.Health, captured_ns=1, id="2", rate=15.0, clock_offset_ns=ahead_ns, clock_error_ns=1000)
    state, _ = play(TRACKED, health)
    assert "viewer 2" in state.warnings["2"]
    late = sighting("2", FIRST)
    _, published = play(state, sighting("1", FIRST), replace(late, captured_ns=late.captured_ns + ahead_ns))
    assert [a.stale for a in assignments(published)[0].views.values()] == [False, False]
    assert play(state, replace(health, clock_offset_ns=1000))[0].warnings == {}


def test_a_turned_body_changes_the_facade_viewer() -> None:
    """Viewer 1 sees the body become narrow and viewer 2 wide: case 2 and both together."""
    state, views = TRACKED, []
    for frame in range(FIRST, FIRST + 3):
        state, published = play(state, sighting("1", frame, view="flank"), sighting("2", frame, view="facade"))
        views.append(views_of(assignments(published)[0]))
    assert views[-1] == {"1": "flank", "2": "facade"}
    assert all(set(pair.values()) == {"facade", "flank"} for pair in views)


def test_rays_that_do_not_intersect_raise_no_error() -> None:
    inconsistent = replace(sighting("2", FIRST), x=50.0, y=0.0)
    _, published = play(TRACKED, sighting("1", FIRST), inconsistent)
    assert np.all(np.isfinite(assignments(published)[0].position))


def test_two_runs_publish_equal_bytes_and_valid_messages() -> None:
    _, again = measured()
    assert [encode(message) for message in again] == [encode(message) for message in INITIAL_MESSAGES]
    _, published = play(
        TRACKED, *(sighting(v, FIRST) for v in VIEWERS), *(partial_bap(v, FIRST, angles()) for v in VIEWERS)
    )
    assert len(published) == 2
    for message in (*INITIAL_MESSAGES, *published):
        assert decode(encode(message), type(message)) == message


def test_a_frame_rate_of_another_integrator_is_answered() -> None:
    state = TRACKED
    for second in range(1, RECOVERY_TICKS + 2):
        state, _ = integrator.step(SETUP, state, Tick(EPOCH_NS + second * 1_000_000_000))
    own = state.rate.decided
    assert own is not None
    other = m.FrameRate(frame=9, captured_ns=0, keep=1, of=100, from_ns=0, phase_ns=0, fps=own.fps)
    for event in (envelope(other), Tick(EPOCH_NS + 60_000_000_000)):
        state, published = integrator.step(SETUP, state, event)
        (answer,) = (message for message in published if isinstance(message, m.FrameRate))
        assert (answer.keep, answer.of) == (own.keep, own.of)
        assert state.sightings.spacing == 1
