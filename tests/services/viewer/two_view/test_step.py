"""Steps of viewers and integrator on rendered frames: no bus, no clock, no threads."""

from copy import deepcopy
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from tests.support.built_messages import built
from tests.support.two_view_run import EMPTY_FRAMES, FPS, PERSON, POSTURE, SEED, VIEWERS, Run, envelope, film, viewer_setup
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.bus.protocol import Alive
from zenocap.common.codec import decode, encode
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.states import LearningBackground
from zenocap.services.viewer.two_view import step as viewer
from zenocap.services.viewer.two_view.states import MeasuringBody, TrackingBody
from zenocap.simulation.body.person import person
from zenocap.simulation.ground_truth import truth
from zenocap.simulation.motion.timeline import posture_timeline

COUNT = 70
SETUP = viewer_setup("1")


def played(count: int = COUNT, leave_out: dict[int, str] | None = None) -> Run:
    """A run over the film; leave_out: a viewer that misses that frame."""
    run = Run()
    for frames in film(COUNT)[:count]:
        k = next(iter(frames.values())).frame
        run.process({id: frame for id, frame in frames.items() if (leave_out or {}).get(k) != id})
    return run


@pytest.fixture(scope="module")
def complete_run() -> Run:
    return played()


@pytest.mark.nightly
def test_viewers_learn_the_background_then_measure_the_body_then_track(complete_run: Run) -> None:
    kinds = [type(message) for message in complete_run.published]
    order = (m.Sighting, m.Assignment, m.PartialBdp, m.UniversalBdp, m.UniversalBap, m.PartialBap)
    first = [kinds.index(kind) for kind in order]
    assert first == sorted(first)
    assert kinds.count(m.UniversalBdp) == 1
    assert all(isinstance(state, TrackingBody) for state in complete_run.viewers.values())


def test_the_background_is_learned_from_the_first_frames_without_messages() -> None:
    run = Run()
    for k, frames in enumerate(film(COUNT)[:EMPTY_FRAMES], start=1):
        assert all(isinstance(state, LearningBackground) for state in run.viewers.values())
        assert run.process(frames) == [], k
    assert all(isinstance(state, MeasuringBody) for state in run.viewers.values())


def test_sightings_of_an_empty_scene_have_no_person() -> None:
    run = played(EMPTY_FRAMES + 2)
    assert {sighting.present for sighting in run.of(m.Sighting)} == {False}
    assert viewer.describe(run.viewers["1"]) == "waiting for a person"


@pytest.mark.slow
def test_after_the_initial_posture_every_frame_has_its_universal_bap(complete_run: Run) -> None:
    baps = complete_run.of(m.UniversalBap)
    frames = [bap.frame for bap in baps]
    assert frames[-1] == COUNT - 1
    assert np.all(np.diff(frames) == 1)
    assert all(not bap.stale for bap in baps[1:])
    assert all(set(bap.views.values()) == {"facade", "flank"} for bap in baps)
    low, high = TEN_PARTS.limits.T
    for bap in baps:
        angles = np.array([bap.angles[name] for name in TEN_PARTS.angles])
        assert np.all((low - 1e-9 <= angles) & (angles <= high + 1e-9))


@pytest.mark.nightly
def test_the_position_is_near_that_of_the_simulated_person(complete_run: Run) -> None:
    subject = person(PERSON)
    script = posture_timeline(subject, POSTURE, SEED)
    off = []
    for bap in complete_run.of(m.UniversalBap):
        off.append(np.array(bap.position) - truth(subject, script.pose_at(bap.frame / FPS)).joints["Hip"])
    assert np.median(np.linalg.norm(off, axis=1)) < 0.12


def test_every_message_is_valid(complete_run: Run) -> None:
    for message in complete_run.published:
        assert decode(encode(message), type(message)) == message


def test_only_assignments_of_complete_frame_sets_answer_a_frame(complete_run: Run) -> None:
    """One that waited for the frame of the other viewer in vain is late without overload."""
    assignment = complete_run.of(m.Assignment)[0]
    frame = assignment.views["1"].frame
    assert viewer.answered_frame("1", assignment) == frame
    stale = {**assignment.views, "2": msgspec.structs.replace(assignment.views["2"], stale=True)}
    assert viewer.answered_frame("1", msgspec.structs.replace(assignment, views=stale)) is None
    assert viewer.answered_frame("3", assignment) is None
    assert all(viewer.answered_frame("1", bap) is None for bap in complete_run.of(m.UniversalBap))


@pytest.mark.slow
def test_two_runs_publish_equal_bytes(complete_run: Run) -> None:
    again = played(45)
    assert [encode(message) for message in again.published] == [
        encode(message) for message in complete_run.published[: len(again.published)]
    ]


def test_a_partial_bap_has_the_frame_and_view_of_its_assignment(complete_run: Run) -> None:
    for message in complete_run.published:
        if isinstance(message, m.Assignment):
            latest = message.views
        if isinstance(message, m.PartialBap):
            assert latest[message.viewer].frame == message.frame
            assert latest[message.viewer].view == message.view


@pytest.mark.nightly
def test_a_viewer_with_missing_frames_is_stale_and_the_other_one_continues() -> None:
    gap = range(50, 56)
    run = played(leave_out=dict.fromkeys(gap, "2"))
    baps = {bap.frame: bap for bap in run.of(m.UniversalBap)}
    assert any(bap.stale == ["2"] for bap in baps.values())
    assert all(bap.stale in ([], ["2"]) for bap in baps.values())
    assert baps[COUNT - 1].stale == [], "the viewer is used again"
    assert isinstance(run.viewers["2"], TrackingBody)


@pytest.mark.nightly
def test_an_assignment_for_another_frame_is_ignored() -> None:
    run = played(50)
    state, messages = viewer.step(SETUP, run.viewers["1"], film(COUNT)[50]["1"])
    assert [type(message) for message in messages] == [m.Sighting]
    last = run.of(m.Assignment)[-1]
    assert last.views["1"].frame == 49
    after, answers = viewer.step(SETUP, state, envelope(last))
    assert answers == []
    assert isinstance(after, TrackingBody)
    assert after.pending is state.pending


@pytest.mark.nightly
def test_a_duplicate_assignment_is_answered_once() -> None:
    run = played(50)
    run.process(film(COUNT)[50])
    last = run.of(m.Assignment)[-1]
    for id in VIEWERS:
        state, answers = viewer.step(viewer_setup(id), run.viewers[id], envelope(last))
        assert answers == []
        assert state is run.viewers[id]


@pytest.mark.slow
def test_a_person_who_leaves_and_returns_is_tracked_again() -> None:
    run = played(50)
    count = len(run.of(m.UniversalBap))
    for k in range(50, 58):  # an empty scene, as at the start
        empty = {id: Frame(k, frame.captured_ns, film(COUNT)[k % 10][id].image) for id, frame in film(COUNT)[k].items()}
        published = run.process(empty)
        assert not any(message.present for message in published if isinstance(message, m.Sighting))
    assert len(run.of(m.UniversalBap)) == count
    for frames in film(COUNT)[58:64]:
        run.process(frames)
    assert all(isinstance(state, TrackingBody) for state in run.viewers.values())
    assert len(run.of(m.UniversalBap)) >= count + 5


@pytest.mark.slow
def test_a_restarted_viewer_uses_the_published_body() -> None:
    run = played(45)
    setup = viewer_setup("2")
    state, messages = viewer.step(setup, viewer.initial_state(setup), envelope(run.of(m.UniversalBdp)[0]))
    assert messages == []
    for k in range(EMPTY_FRAMES):
        state, _ = viewer.step(setup, state, film(COUNT)[k]["2"])
    assert isinstance(state, MeasuringBody)
    run.viewers["2"] = state
    for frames in film(COUNT)[45:60]:
        run.process(frames)
    assert isinstance(run.viewers["2"], TrackingBody)
    assert run.of(m.UniversalBap)[-1].stale == []


@pytest.mark.nightly
def test_a_restarted_integrator_makes_the_viewers_measure_again() -> None:
    run = played(50)
    last = run.of(m.Assignment)[-1]
    restarted = built(m.Assignment, frame=last.frame, captured_ns=last.captured_ns, position=last.position, tracking=False)
    state, messages = viewer.step(SETUP, run.viewers["1"], envelope(restarted))
    assert isinstance(state, MeasuringBody)
    assert messages == []


def test_other_events_change_no_state(complete_run: Run) -> None:
    health = built(m.Health, captured_ns=1, id="2")
    foreign = complete_run.of(m.Sighting)[0]
    for state in (viewer.initial_state(SETUP), played(EMPTY_FRAMES).viewers["1"], complete_run.viewers["1"]):
        for event in (envelope(health), envelope(foreign), Alive("viewer", "2", False, 5)):
            unchanged, messages = viewer.step(SETUP, state, event)
            assert unchanged is state
            assert messages == []


@pytest.mark.nightly
def test_a_step_does_not_modify_its_argument() -> None:
    """After a failed step the previous state must be intact."""
    run = played(49)
    before = run.viewers["1"]
    pose, usual_score = deepcopy(before.pose), before.usual_score
    twice = [viewer.step(SETUP, before, film(COUNT)[49]["1"])[1] for _ in range(2)]
    assert [encode(message) for message in twice[0]] == [encode(message) for message in twice[1]]
    np.testing.assert_array_equal(before.pose.angles, pose.angles)
    assert before.usual_score == usual_score


def test_the_health_text_asks_to_stretch_hanging_arms() -> None:
    run = Run()
    hanging = range(47, 51)  # after the arms are down, before they are raised
    for k in (*range(EMPTY_FRAMES), *hanging):
        run.process(film(COUNT)[k])
    assert viewer.describe(run.viewers["1"]) == "hold the T-pose, facing this camera"
    assert all(message.side == "side" for message in run.published if isinstance(message, m.PartialBdp))
    assert not run.of(m.UniversalBap)


@pytest.mark.slow
def test_previews_are_sent_only_when_enabled_and_at_most_five_a_second() -> None:
    def previews(publish: bool) -> list[int]:
        setup = replace(SETUP, publish_preview=publish)
        state, sent = viewer.initial_state(setup), []
        for frames in film(COUNT):
            state, messages = viewer.step(setup, state, frames["1"])
            sent += [message.captured_ns for message in messages if isinstance(message, m.Preview)]
        return sent

    assert previews(False) == []
    times = previews(True)
    assert len(times) > 2
    assert min(np.diff(times)) >= 200_000_000


def test_tracking_starts_with_body_and_pose_in_any_order_or_without_a_pose(complete_run: Run) -> None:
    measuring = played(EMPTY_FRAMES + 2).viewers["1"]
    assert isinstance(measuring, MeasuringBody)
    body, pose = complete_run.of(m.UniversalBdp)[0], complete_run.of(m.UniversalBap)[0]
    placed = next(message for message in complete_run.of(m.Assignment) if message.tracking)
    for order in ((body, pose), (pose, body), (body, placed)):
        state = measuring
        for message in order:
            state, _ = viewer.step(SETUP, state, envelope(message))
        assert isinstance(state, TrackingBody)


@pytest.mark.slow
def test_a_viewer_with_a_body_measures_again_on_request(complete_run: Run) -> None:
    run = played(EMPTY_FRAMES + 2)
    run.viewers["1"], _ = viewer.step(SETUP, run.viewers["1"], envelope(complete_run.of(m.UniversalBdp)[0]))
    assert viewer.describe(run.viewers["1"]) == "waiting for the pose of the integrator"
    for frames in film(COUNT)[EMPTY_FRAMES + 2 : EMPTY_FRAMES + 20]:
        run.process(frames)
    assert any(message.viewer == "1" for message in run.of(m.PartialBdp))


@pytest.mark.nightly
def test_a_false_assignment_interrupts_tracking_for_one_frame() -> None:
    run = played(50)
    run.send_to_viewers([built(m.Assignment, tracking=False)])
    assert all(isinstance(state, MeasuringBody) for state in run.viewers.values())
    for frames in film(COUNT)[50:52]:
        run.process(frames)
    assert all(isinstance(state, TrackingBody) for state in run.viewers.values())
    assert run.of(m.UniversalBap)[-1].frame == 51


def test_a_pose_of_another_anatomy_does_not_prevent_tracking(complete_run: Run) -> None:
    state = played(EMPTY_FRAMES + 2).viewers["1"]
    body, pose = complete_run.of(m.UniversalBdp)[0], complete_run.of(m.UniversalBap)[0]
    with pytest.raises(ValueError, match=r"tail\.x"):
        viewer.step(SETUP, state, envelope(msgspec.structs.replace(pose, angles={"tail.x": 1.0})))
    for message in (body, pose):
        state, _ = viewer.step(SETUP, state, envelope(message))
    assert isinstance(state, TrackingBody)


@pytest.mark.nightly
def test_a_viewer_without_assignments_for_seconds_returns_to_measuring() -> None:
    run = played(50)
    state, frame = run.viewers["1"], film(COUNT)[50]["1"]
    assert isinstance(state, TrackingBody)
    for second in range(5):
        at = replace(frame, frame=frame.frame + second, captured_ns=frame.captured_ns + second * 1_000_000_000)
        state, _ = viewer.step(SETUP, state, at)
        assert isinstance(state, TrackingBody if second < 3 else MeasuringBody)
    assert state.bdp is not None


@pytest.mark.nightly
def test_a_person_out_of_view_for_long_is_tracked_again_within_two_frames() -> None:
    run = played(50)
    before = len(run.of(m.UniversalBap))
    for frames in film(COUNT)[50:58]:
        run.process({id: replace(frame, captured_ns=frame.captured_ns + 5_000_000_000) for id, frame in frames.items()})
    assert len(run.of(m.UniversalBap)) >= before + 6
    assert all(isinstance(state, TrackingBody) for state in run.viewers.values())
