"""Lags of views, found from the silhouettes of a take, and the reason that states them."""

from collections.abc import Mapping

import msgspec
import pytest

from tests.support.built_messages import built, camera_message, silhouette
from tests.support.moving_balls import mask_of, ring
from zenocap.common import messages as m
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.body.proportions import t_pose_angles
from zenocap.common.conversion import angles_by_name, body_of
from zenocap.common.lags.pairs import VideoOffset
from zenocap.services.tracker.body.average_body import average_body
from zenocap.tools.judge.evidence import evidence_of
from zenocap.tools.judge.verdict import verdict_of
from zenocap.tools.judge.view_lag import lags_of, view_lags

FPS, FRAMES, START_NS, BEGIN_S = 25.0, 150, 10**18, 3.0
CAMERAS = ring((0, 90, 45))


def messages(starts_s: Mapping[str, float], *, posed: bool = True, still: bool = False) -> list[m.Message]:
    """Silhouettes of a moving body in videos that begin at different times and do not say so, and poses that do not fit."""
    found: list[m.Message] = [camera_message(CAMERAS[name], captured_ns=START_NS) for name in starts_s]
    if posed:
        body = body_of(FOURTEEN_PARTS, average_body(FOURTEEN_PARTS, 1.75))
        found.append(m.TrackerBdp(frame=0, captured_ns=START_NS, body=body))
    for k in range(FRAMES):
        captured_ns = START_NS + round(k * 1e9 / FPS)
        for name, start_s in starts_s.items():
            mask = mask_of(CAMERAS[name], BEGIN_S + start_s + k / FPS, still=still)
            found.append(silhouette(name, k, captured_ns, mask))
        if posed:
            found.append(
                built(
                    m.TrackerPose, frame=k, captured_ns=captured_ns,
                    angles=angles_by_name(FOURTEEN_PARTS, t_pose_angles(FOURTEEN_PARTS)), views=list(starts_s),
                )
            )  # fmt: skip
    return found


@pytest.mark.slow
@pytest.mark.parametrize("lag_s", [-0.5, 0.2, 1.0])
def test_a_view_that_is_late_is_named_with_its_lag(lag_s: float) -> None:
    found = view_lags(evidence_of(messages({"cam01": 0.0, "cam02": lag_s})))
    assert found is not None
    assert found.others == ("cam01",)
    assert found.views == pytest.approx({"cam02": lag_s}, abs=0.02)


@pytest.mark.nightly
def test_the_reason_names_the_view_the_lag_and_the_command() -> None:
    verdict = verdict_of(evidence_of(messages({"cam01": 0.0, "cam02": 0.2, "cam03": 0.0})))
    assert verdict.rating != "good"
    apart = [reason for reason in verdict.reasons if reason.kind == "views-apart"]
    assert [reason.viewers for reason in apart] == [["cam02"]]
    assert apart[0].text.startswith("camera cam02 is about 0.20 s later than the others: ")
    assert "zenocap sync" in apart[0].text
    assert verdict.reasons[0] == apart[0]


@pytest.mark.nightly
def test_a_lag_too_short_to_be_stated_is_the_cause_of_a_contradiction() -> None:
    evidence = evidence_of(messages({"cam01": 0.0, "cam02": 0.09}))
    assert view_lags(evidence) is None
    (apart,) = (reason for reason in verdict_of(evidence).reasons if reason.kind == "views-apart")
    assert apart.text.startswith("cameras cam01 and cam02 contradict each other by ")
    assert "different times" in apart.text
    assert "calibration" not in apart.text


@pytest.mark.slow
def test_a_take_without_poses_names_the_view_too() -> None:
    verdict = verdict_of(evidence_of(messages({"cam01": 0.0, "cam02": -0.5}, posed=False)))
    assert [reason.kind for reason in verdict.reasons] == ["views-apart", "no-pose"]
    assert "camera cam02 is about 0.50 s earlier than camera cam01" in verdict.reasons[0].text
    assert verdict.reasons[1].text == "no pose"  # and no fault of a rig that is judged from views out of step


@pytest.mark.nightly
@pytest.mark.parametrize("options", [{}, {"still": True}])
def test_views_in_step_and_a_still_body_have_no_lag(options: dict[str, bool]) -> None:
    evidence = evidence_of(messages({"cam01": 0.0, "cam02": 0.0}, **options))
    assert view_lags(evidence) is None
    assert not any("times say" in reason.text for reason in verdict_of(evidence).reasons)


@pytest.mark.slow
def test_unrelated_silhouettes_have_no_lag() -> None:
    """The second view shows another stretch of the motion, 40 s later."""
    assert view_lags(evidence_of(messages({"cam01": 0.0, "cam02": 40.0}))) is None


def offset(offset_s: float, error_s: float = 0.001) -> VideoOffset:
    return VideoOffset(offset_s, error_s, 20.0, 1.0, 1)


def test_those_that_most_others_agree_with_are_in_step() -> None:
    found = lags_of({"a": offset(0.0), "b": offset(0.41), "c": offset(0.40), "d": offset(0.42)}, 0.04)
    assert found is not None
    assert (found.others, found.views) == (("b", "c", "d"), {"a": pytest.approx(-0.41)})


def test_a_lag_that_is_short_or_within_its_error_is_not_stated() -> None:
    for other, least_s in ((offset(0.09), 0.04), (offset(0.14, 0.05), 0.04), (offset(0.14), 0.15), (None, 0.04)):
        assert lags_of({"a": offset(0.0)} | ({"b": other} if other else {}), least_s) is None


def test_memory_does_not_grow_with_the_take() -> None:
    evidence = evidence_of(messages({"cam01": 0.0}, posed=False))
    before = len(evidence.beginnings["cam01"])
    later = [one for one in messages({"cam01": 0.0}, posed=False) if isinstance(one, m.Silhouette)][:50]
    for one in later:
        evidence.add(msgspec.structs.replace(one, captured_ns=one.captured_ns + 60 * 10**9))
    assert len(evidence.beginnings["cam01"]) == before
