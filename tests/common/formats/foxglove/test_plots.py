"""Plots: each number under one name, in display units."""

import json

import pytest

from tests.support.built_messages import built
from zenocap.common import messages as m
from zenocap.common.formats.foxglove.plots import health_json, pose_json, posture_json, sighting_json, tracker_json

POSE = {"frame": 3, "position": (0.5, 1.0, -0.25)}
SHOWN = {"position": {"x": 0.5, "y": 1.0, "z": -0.25}}


@pytest.mark.parametrize("lost", ["right_arm", "person"])
def test_a_pose_is_plotted_in_degrees_and_metres_and_without_them_when_lost(lost: str) -> None:
    bap = built(
        m.UniversalBap, **POSE, angles={"navel.y": 0.5235987755982988, "left_elbow.x": -1.0},
        scores={"1": 0.75, "2": 0.5}, views={"1": "facade", "2": "flank"}, stale=["2"], lost=[lost],
    )  # fmt: skip
    tracked = lost != "person"
    expected = {
        "frame": 3, "tracked": tracked, "lost": [lost], "stale": ["2"],
        "viewers": [{"viewer": "1", "score": 0.75, "view": "facade"}, {"viewer": "2", "score": 0.5, "view": "flank"}],
    }  # fmt: skip
    if tracked:
        expected |= SHOWN | {"angles_deg": {"navel": {"y": 30.0}, "left_elbow": {"x": -57.296}}}
    assert json.loads(pose_json(bap)) == expected


def test_the_tilt_of_a_sighting_is_plotted_in_degrees() -> None:
    content = json.loads(sighting_json(built(m.Sighting, view="flank", score=0.9, tilt=-0.5235987755982988)))
    assert content["tilt_deg"] == pytest.approx(-30)
    assert (content["present"], content["view"], content["score"]) == (True, "flank", 0.9)


def test_health_is_plotted_in_milliseconds_and_megabytes() -> None:
    health = built(
        m.Health, phase=m.Phase.TRACKING, state="tracking", rate=29.9, stages_ms={"step_frame": 3.5}, counts={"late": 2},
        clock_offset_ns=-1_500_000, clock_error_ns=250_000, memory_bytes=123_000_000,
    )  # fmt: skip
    assert json.loads(health_json(health)) == {
        "phase": "tracking", "state": "tracking", "rate": 29.9, "clock_offset_ms": -1.5, "clock_error_ms": 0.25,
        "memory_mb": 123.0, "stages": [{"name": "step_frame", "ms": 3.5}], "counts": [{"name": "late", "count": 2}],
    }  # fmt: skip


@pytest.mark.parametrize("lost", [False, True])
def test_a_tracker_pose_is_plotted_with_its_spread(lost: bool) -> None:
    pose = built(
        m.TrackerPose, **POSE, angles={"left_elbow.x": 1.0}, position_spread=(0.003, 0.0, 0.004), likelihood=-2.5,
        effective=11.0, lost=lost, views=["2"],
    )  # fmt: skip
    expected: dict[str, object] = {
        "frame": 3, "tracked": not lost, "lost": ["person"] if lost else [], "stale": [], "likelihood": -2.5,
        "effective": 11.0, "spread_mm": 5.0, "viewers": [{"viewer": "2", "view": "used"}],
    }  # fmt: skip
    if not lost:
        expected |= SHOWN | {"angles_deg": {"left_elbow": {"x": 57.296}}}
    assert json.loads(tracker_json(pose)) == expected


def test_a_posture_is_plotted_in_seconds_and_has_a_label_when_unknown() -> None:
    posture = built(
        m.Posture, captured_ns=3_300_000_000, start_ns=500_000_000, end_ns=3_000_000_000,
        log_likelihoods={"kick": -90.0, "squat": -95.0},
    )  # fmt: skip
    plain = json.loads(posture_json(posture))
    assert (plain["label"], plain["known"]) == ("unknown movement", False)
    assert (plain["start_s"], plain["end_s"], plain["lasted_s"]) == (0.5, 3.0, 2.5)
    assert round(plain["late_s"], 9) == 0.3
    assert plain["log_likelihoods"] == [{"label": "kick", "value": -90.0}, {"label": "squat", "value": -95.0}]
