"""The verdict: laws of its figures, classes, reasons, and its way through takes and commands."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from tests.support.built_messages import built, camera_message, silhouette
from tests.support.simulated_cameras import paper_cameras
from zenocap.common import codec
from zenocap.common import messages as m
from zenocap.common.arrays import Mask
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.body.definition import Pose
from zenocap.common.body.proportions import HIP_HEIGHT, t_pose_angles
from zenocap.common.conversion import angles_by_name, body_of, silhouette_mask
from zenocap.common.messages import AdviceCode
from zenocap.services.tracker.body.average_body import average_body
from zenocap.tools.judge.evidence import evidence_of
from zenocap.tools.judge.features import FEATURES, Apart, Stretch, stretch_numbers, stretches_of
from zenocap.tools.judge.overlap import body_mask, body_points, view_sample
from zenocap.tools.judge.parameters import LONGEST_GAP_NS, STRETCH_NS
from zenocap.tools.judge.text import contradiction_cause, part_lines
from zenocap.tools.judge.verdict import KINDS, expected_errors, verdict_of
from zenocap.tools.takes.track import Tracked

SIZE = (320, 240)
FRAME_NS, FRAMES = 40_000_000, 75
START_NS = 10**18
ANATOMY = FOURTEEN_PARTS
Change = Callable[[str, Mask], Mask]  # of a view and a silhouette


def messages(
    *, swapped: bool = False, silhouettes: bool = True, change: Change = lambda _, mask: mask, frame_ns: int = FRAME_NS
) -> list[m.Message]:
    """A person in the T-pose, who walks sideways: silhouettes of the body itself, and its true poses.

    change: of a view's silhouettes.
    """
    cameras = {camera.name: camera for camera in paper_cameras(SIZE)}
    body = average_body(ANATOMY, 1.75)
    found: list[m.Message] = [camera_message(camera, captured_ns=START_NS) for camera in cameras.values()]
    found.append(m.TrackerBdp(frame=0, captured_ns=START_NS, body=body_of(ANATOMY, body)))
    for k in range(FRAMES):
        captured_ns = START_NS + k * frame_ns
        pose = Pose(np.array([-0.6 + 0.01 * k, HIP_HEIGHT * 1.75, 0.3]), t_pose_angles(ANATOMY))
        points = body_points(ANATOMY, body, pose)
        masks = {name: body_mask(camera, points)[0] for name, camera in cameras.items()}
        if swapped:
            masks = dict(zip(masks, reversed(masks.values()), strict=True))
        for name, mask in masks.items():
            if silhouettes:
                found.append(silhouette(name, k, captured_ns, change(name, mask)))
        x, y, z = pose.position.tolist()
        limbs = dict.fromkeys(("right_arm", "left_arm", "right_leg", "left_leg"), 0.95)
        found.append(
            built(
                m.TrackerPose, frame=k, captured_ns=captured_ns, position=(x, y, z),
                angles=angles_by_name(ANATOMY, pose.angles), views=list(cameras), limbs=limbs, heading=0.99,
            )
        )  # fmt: skip
    return found


def without_legs(_: str, mask: Mask) -> Mask:
    return np.where(np.arange(len(mask))[:, None] < 150, mask, 0).astype(np.uint8)


def turned(view: str, mask: Mask) -> Mask:
    """As a camera that was turned by two degrees shows them."""
    return np.roll(mask, 10, axis=0) if view == "cam02" else mask


def shaded(view: str, mask: Mask) -> Mask:
    """With a shadow of 4 px below the feet."""
    lowest = np.flatnonzero(mask.any(axis=1))[-1]
    rows = np.arange(len(mask))[:, None]
    return np.where((rows > lowest) & (rows <= lowest + 4), mask[lowest], mask) if view == "cam02" else mask


def without_poses(frames: set[int], frame_ns: int = FRAME_NS) -> list[m.Message]:
    every = messages(frame_ns=frame_ns)
    return [one for one in every if not (isinstance(one, m.TrackerPose) and one.frame in frames)]


def figure(name: str, every: list[m.Message]) -> float:
    return float(np.mean([one.values[FEATURES.index(name)] for one in stretches_of(evidence_of(every))]))


@pytest.mark.slow
def test_a_body_that_covers_its_silhouettes_is_good_with_equal_bytes_each_time() -> None:
    every = messages()
    found = verdict_of(evidence_of(every))
    assert (found.rating, found.evidence, found.reasons) == ("good", "one-pass", [])
    assert [one.rating for one in found.stretches] == ["good"] * 3
    assert codec.encode(verdict_of(evidence_of(every))) == codec.encode(found)


@pytest.mark.nightly
@pytest.mark.parametrize(("change", "worse"), [({"swapped": True}, True), ({"change": without_legs}, False)])
def test_swapped_cameras_and_missing_legs_lower_the_overlap_and_are_not_good(change: dict[str, Any], worse: bool) -> None:
    assert figure("outside", messages()) < 0.01
    changed = messages(**change)
    assert figure("outside", changed) + figure("uncovered", changed) > 0.15
    found = verdict_of(evidence_of(changed))
    assert found.rating != "good"
    assert "overlap" in [reason.kind for reason in found.reasons]
    assert (found.error > verdict_of(evidence_of(messages())).error) is worse  # the poses are true


@pytest.mark.slow
def test_a_camera_that_was_turned_contradicts_the_other_in_pixels_at_the_head() -> None:
    found = verdict_of(evidence_of(messages(change=turned)))
    assert found.rating != "good"
    (apart,) = (one for one in found.reasons if one.kind == "views-apart")
    assert sorted(apart.viewers) == ["cam01", "cam02"]
    text = "contradict each other by 10.0 px at the head: wrong calibration, a camera that was moved, or"
    assert re.sub(r"\b(9|10)\.\d px", "10.0 px", apart.text) == f"cameras cam01 and cam02 {text} swapped videos"
    assert "feet" not in [one.kind for one in found.reasons]


@pytest.mark.slow
def test_a_shadow_at_the_feet_is_no_contradiction_of_the_cameras() -> None:
    every = messages(change=shaded)
    found = verdict_of(evidence_of(every))
    assert (found.rating, found.reasons) == ("good", [])
    assert 2.5 < figure("feet apart", every) < 4.0
    assert figure("apart", every) < 0.3
    lost = verdict_of(evidence_of([one for one in every if not (isinstance(one, m.TrackerPose) and one.frame > 65)]))
    (feet,) = (one for one in lost.reasons if one.kind == "feet")
    assert feet.viewers == ["cam02"]
    assert re.match(r"lower edges of camera cam02 are [23]\.\d px low: shadow or mirror image at the feet", feet.text)
    assert not {"views-apart", "overlap"} & {one.kind for one in lost.reasons}


@pytest.mark.parametrize(
    ("higher", "speed", "named"),
    [
        ((3.0, 4.0, 3.5, 2.5), (0.0, 5.0, -5.0, 2.0), {"calibration"}),
        ((0.5, 4.0, -4.0, 2.0), (0.0, 5.0, -5.0, 2.0), {"zenocap sync"}),
        ((4.0, -4.0, 4.0, -4.0), (5.0, 5.0, -5.0, -5.0), {"calibration", "zenocap sync"}),
    ],
)
def test_a_contradiction_that_stays_is_of_the_calibration_and_one_that_grows_with_the_speed_of_times(
    higher: tuple[float, ...], speed: tuple[float, ...], named: set[str]
) -> None:
    """Signed, px, by second; the speed too."""
    views = dict.fromkeys(("a", "b"), view_sample(paper_cameras(SIZE)[0], np.ones(SIZE[::-1], np.uint8), None))
    every = [Apart(abs(d), d, 0.0, d * d, d * v, v * v) for d, v in zip(higher, speed, strict=True)]
    stretches = [Stretch(0, 1, np.zeros(len(FEATURES)), views, dict.fromkeys(views, one), 25) for one in every]
    cause = contradiction_cause(stretches)
    assert {word for word in ("calibration", "zenocap sync") if word in cause} == named


@pytest.mark.slow
@pytest.mark.parametrize(("limbs", "heading", "worst"), [({"right_arm": 0.2}, 0.6, 0.8), ({}, None, 0.05)])
def test_a_limb_taken_backwards_is_as_certain_as_there_and_as_forwards_in_takes_that_do_not_state_it(
    limbs: dict[str, float], heading: float | None, worst: float
) -> None:
    every = messages()
    for k in range(len(every) - 1, -1, -1):
        if isinstance(one := every[k], m.TrackerPose):
            stated = {name: score for name, score in one.limbs.items() if name != "right_arm"} | limbs
            fields = msgspec.structs.asdict(one) | {"limbs": stated, "heading": heading, "backward": {"right_arm": 1.0}}
            every.insert(k + 1, m.BothWaysPose(**fields))
    assert figure("worst limb", every) == pytest.approx(worst)
    assert figure("limbs", every) == pytest.approx((3 * 0.05 + worst) / 4)
    assert figure("heading", every) == pytest.approx(0.01 if heading is None else 1.0 - heading)


@pytest.mark.slow
def test_poses_alone_are_never_good_and_a_take_without_poses_is_unusable() -> None:
    found = verdict_of(evidence_of(messages(silhouettes=False)))
    assert (found.rating, found.evidence, found.reasons[0].kind) == ("doubtful", "poses-only", "no-silhouettes")
    found = verdict_of(evidence_of([one for one in messages() if not isinstance(one, m.TrackerPose | m.TrackerBdp)]))
    assert (found.rating, found.evidence, [one.kind for one in found.reasons]) == ("unusable", "none", ["no-pose"])
    assert "the silhouettes do not show why" in found.reasons[0].text


@pytest.mark.slow
def test_missing_legs_are_the_first_reason_where_nothing_was_tracked() -> None:
    every = [one for one in messages(change=without_legs) if not isinstance(one, m.TrackerPose | m.TrackerBdp)]
    found = verdict_of(evidence_of(every))
    assert [one.kind for one in found.reasons] == ["no-legs", "no-pose"]
    assert found.reasons[0].viewers == ["cam01", "cam02"]
    assert "which end 0.50 m above the floor" in found.reasons[0].text


def advised(*codes: AdviceCode, value: float = 80.0) -> list[m.Message]:
    """Reports of a camera, each second."""
    faults = [m.CameraFault(code=code, value=value, limit=30.0, unit="%") for code in codes]
    return [
        m.CameraAdvice(frame=k, captured_ns=START_NS + k * FRAME_NS, viewer="cam01", faults=faults)
        for k in range(0, FRAMES, 25)
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("code", "kind", "words"),
    [
        (AdviceCode.PEOPLE, "two-people", "camera cam01: a second person"),
        (AdviceCode.UNCOVERED, "not-empty", "a person or thing"),
    ],
)
def test_what_the_cameras_show_is_the_first_reason(code: AdviceCode, kind: str, words: str) -> None:
    lost = [one for one in messages() if not isinstance(one, m.TrackerPose | m.TrackerBdp)]
    for every, last in ((lost, "no-pose"), (without_poses(set(range(30, FRAMES))), "lost")):
        found = verdict_of(evidence_of([*every, *advised(code)]))
        assert [found.reasons[0].kind, found.reasons[1].kind] == [kind, last]
        assert words in found.reasons[0].text
    assert verdict_of(evidence_of([*messages(), *advised(code)])).reasons == []


@pytest.mark.slow
@pytest.mark.parametrize(("value", "first", "place"), [(80.0, "not-empty", 0), (5.0, "lost", -1)])
def test_a_person_in_many_images_of_the_empty_scene_is_the_first_reason_and_in_few_the_last(
    value: float, first: str, place: int
) -> None:
    lost = [one for one in messages() if not isinstance(one, m.TrackerPose | m.TrackerBdp)]
    for every, kind, at in ((lost, "not-empty", 0), (without_poses(set(range(30, FRAMES))), first, place)):
        found = verdict_of(evidence_of([*every, *advised(AdviceCode.OCCUPIED, value=value)]))
        assert (found.reasons[0].kind, found.reasons[at].kind) == (kind, "not-empty")
        (text,) = (one.text for one in found.reasons if one.kind == "not-empty")
        assert f"camera cam01: a person is in {value:.0f} % of the images that should show the empty scene" in text
        assert "empty_seconds" in text
    assert verdict_of(evidence_of([*messages(), *advised(AdviceCode.OCCUPIED, value=value)])).reasons == []


@pytest.mark.slow
def test_a_person_who_was_in_all_images_of_the_empty_scene_is_named() -> None:
    """The place that the person left stays in the silhouettes."""
    every: list[m.Message] = []
    for one in messages():
        if isinstance(one, m.Silhouette):
            mask = silhouette_mask(one)
            mask[60:200, 20:60] = 1
            one = silhouette(one.viewer, one.frame, one.captured_ns, mask)
        every.append(one)
    (reason,) = (one for one in verdict_of(evidence_of(every)).reasons if one.kind == "overlap")
    assert "someone in the empty scene (empty_seconds)" in reason.text


@pytest.mark.slow
def test_frames_with_a_person_but_without_pose_count_as_lost() -> None:
    found = verdict_of(evidence_of(without_poses(set(range(30, FRAMES)))))
    assert found.rating == "unusable"
    assert found.reasons[0].kind == "lost"
    assert found.stretches[-1].lost == 1.0
    lines = [*found.text.splitlines(), *part_lines(found, START_NS)]
    assert lines[0].startswith("verdict: unusable")
    assert any("unusable, 500 mm: lost" in line for line in lines)


@pytest.mark.slow
@pytest.mark.parametrize("frames", [range(27), range(23, 52), range(48, FRAMES)], ids=["late", "back again", "early"])
def test_lost_poses_count_while_the_person_is_in_view_only(frames: range) -> None:
    lost, left = [], []
    for one in messages():
        if isinstance(one, m.TrackerPose) and one.frame in frames:
            one = msgspec.structs.replace(one, lost=True)
        lost.append(one)
        if isinstance(one, m.Silhouette) and one.frame in frames:
            one = msgspec.structs.replace(one, region=(0, 0, 0, 0), data=b"")
        left.append(one)
    found = verdict_of(evidence_of(left))
    assert (found.rating, {one.lost for one in found.stretches}) == ("good", {0.0})
    found = verdict_of(evidence_of(lost))
    assert (found.rating, found.reasons[0].kind) == ("unusable", "lost")


@pytest.mark.slow
def test_what_lies_before_the_first_pose_counts_in_a_short_take() -> None:
    """The tracker needs 1.2 s to start without a T-pose: of 3 s that is too much, of a long take it is not."""
    found = verdict_of(evidence_of(without_poses(set(range(36)))))
    assert (found.rating, found.reasons[0].kind) == ("unusable", "lost")
    assert found.stretches[0].start_ns - START_NS == pytest.approx(0.6e9, abs=0.1e9)
    assert verdict_of(evidence_of(without_poses(set(range(12))))).rating == "good"


@pytest.mark.slow
@pytest.mark.parametrize(("first", "start_s", "rating"), [(7, 1.4, "good"), (25, 1.5, "unusable")])
def test_what_lies_before_the_first_pose_counts_in_a_long_take_after_a_second_and_a_half(
    first: int, start_s: float, rating: m.Rating
) -> None:
    """Of 15 s in view, at five frames a second."""
    found = verdict_of(evidence_of(without_poses(set(range(first)), 5 * FRAME_NS)))
    assert (found.rating, [one.kind for one in found.reasons][:1]) == (rating, ["lost"] if first > 7 else [])
    assert (found.stretches[0].start_ns - START_NS) / 1e9 == pytest.approx(start_s, abs=0.25)


@pytest.mark.slow
def test_the_cause_comes_before_the_poses_that_are_lost_by_it() -> None:
    lost = set(range(15, 70))
    every = [one for one in messages(swapped=True) if not (isinstance(one, m.TrackerPose) and one.frame in lost)]
    kinds = [reason.kind for reason in verdict_of(evidence_of(every)).reasons]
    assert kinds[0] in ("overlap", "views-apart")
    assert "lost" in kinds
    assert verdict_of(evidence_of(without_poses(lost))).reasons[0].kind == "lost"


@pytest.mark.slow
def test_a_pose_between_two_others_may_be_missing() -> None:
    """At a variable frame rate single frames are missing: the poses are interpolated there."""
    found = verdict_of(evidence_of(without_poses({22, 25, 31, 40, 50, 52, 60})))
    assert (found.rating, [one.lost for one in found.stretches]) == ("good", [0.0, 0.0, 0.0])


@pytest.mark.slow
def test_poses_that_are_missing_one_after_the_other_are_lost() -> None:
    """Also where every silhouette that is sampled has a pose."""
    missing = {k for k in range(15, 75) if k % 6 in (2, 3, 4)}
    found = verdict_of(evidence_of(without_poses(missing)))
    assert found.rating == "unusable"
    assert found.error < 0.1  # the poses that are there are right
    assert found.reasons[0].kind == "lost"
    assert [one.lost for one in found.stretches[1:]] == pytest.approx([0.5, 0.5], abs=0.06)


def repeating(which: Callable[[int], int], *viewers: str) -> list[m.Message]:
    """The messages with the silhouettes of some cameras of other frames.  which: of each frame."""
    every = messages()
    seen = {(one.viewer, one.frame): one for one in every if isinstance(one, m.Silhouette)}

    def shown(one: m.Message) -> m.Message:
        if not isinstance(one, m.Silhouette) or one.viewer not in viewers:
            return one
        other = seen[one.viewer, which(one.frame)]
        return msgspec.structs.replace(one, region=other.region, data=other.data)

    return [shown(one) for one in every]


@pytest.mark.slow
@pytest.mark.parametrize(("last", "end_s", "rating"), [(60, 2.4, "unusable"), (35, 1.4, "doubtful")])
def test_a_frozen_camera_is_the_first_reason_and_of_two_cameras_frames_with_it_are_lost(
    last: int, end_s: float, rating: m.Rating
) -> None:
    every = repeating(lambda k: min(k, 25) if k <= last else k, "cam02")
    found = verdict_of(evidence_of(every))
    assert found.rating == rating
    assert (found.reasons[0].kind, found.reasons[0].viewers) == ("frozen", ["cam02"])
    assert f"camera cam02 shows the same picture from 1.0 to {end_s} s: cable" in found.reasons[0].text
    assert found.reasons[1].kind == "lost"


@pytest.mark.slow
def test_a_person_who_stands_still_and_a_camera_of_half_the_rate_are_not_frozen() -> None:
    for every in (repeating(lambda k: min(k, 25), "cam01", "cam02"), repeating(lambda k: k - k % 2, "cam02")):
        assert evidence_of(every).repeated.frozen == {}


UNUSED: dict[str, tuple[str, ...]] = {  # features that the model of a kind of evidence does not use
    "both-ways": ("missing", "feet apart"),
    "one-pass": ("missing", "feet apart", "passes"),
    "two-view": ("missing", "feet apart", "passes", "unused", "limbs", "worst limb", "heading", "average body"),
    "poses-only": (
        "missing", "passes", "unused", "outside", "outside, all views", "uncovered", "uncovered, all views", "apart",
        "feet apart", "cut", "hidden", "empty",
    ),
}  # fmt: skip


@pytest.mark.nightly
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", [name for name in FEATURES if name != "lost"])
def test_a_larger_figure_never_lowers_the_expected_error(kind: str, name: str) -> None:
    stretch = stretches_of(evidence_of(messages()))[0]
    values = np.repeat(np.nan_to_num(stretch.values)[None], 5, axis=0)
    values[:, FEATURES.index(name)] = (0.0, 0.1, 0.3, 0.7, 1.0)
    errors = expected_errors(kind, [replace(stretch, values=row) for row in values])
    assert (np.diff(errors) >= 0.0).all()
    if name in UNUSED[kind]:
        assert np.ptp(errors) == 0.0


@pytest.mark.parametrize(("rating", "status"), [("good", 0), ("doubtful", 3), ("unusable", 4)])
def test_the_exit_status_tells_the_class(rating: m.Rating, status: int, tmp_path: Path) -> None:
    from zenocap.tools.cli.track import _status

    verdict = built(m.Verdict, rating=rating, evidence="one-pass")
    assert _status(Tracked(1, 1, 1, (), {}, verdict=verdict)) == status


@pytest.mark.nightly
@pytest.mark.timeout(60)
@pytest.mark.parametrize("silhouettes", [True, False])
def test_a_clock_that_was_set_by_decades_takes_neither_minutes_nor_the_memory(silhouettes: bool) -> None:
    every = messages(silhouettes=silhouettes)
    pose = next(message for message in every if isinstance(message, m.TrackerPose))
    stretches = stretches_of(evidence_of([msgspec.structs.replace(pose, captured_ns=1), *every]))
    assert len(stretches) <= 2 + LONGEST_GAP_NS // STRETCH_NS + FRAMES
    poses = sum(one.frames for one in stretches)
    assert poses == FRAMES + 1


@pytest.mark.slow
@pytest.mark.parametrize("change", [{"size": (0, 0)}, {"matrix": [0.0] * 9}, {"rotation": [1e9] * 9}])
def test_a_camera_that_cannot_be_one_is_ignored(change: dict[str, object]) -> None:
    """As of a program that is not of the rig, on an open network; `zenocap info` ended with a traceback."""
    every = messages()
    camera = next(message for message in every if isinstance(message, m.CameraInfo))
    stranger = msgspec.structs.replace(camera, viewer="stranger", **change)
    assert verdict_of(evidence_of([stranger, *every])) == verdict_of(evidence_of(every))


def test_every_stretch_of_an_ordinary_gap_counts() -> None:
    assert list(stretch_numbers({0, 1, 5, -3, 900}, 10)) == list(range(10))
    hour = LONGEST_GAP_NS // STRETCH_NS
    assert list(stretch_numbers({0, 10**9}, 10**9 + 2)) == [*range(hour + 1), 10**9, 10**9 + 1]
