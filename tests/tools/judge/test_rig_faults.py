"""Hypotheses on the rig: which of several that hold is stated."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.support.built_messages import built, camera_message, silhouette
from tests.support.walkers import walker
from zenocap.common import messages as m
from zenocap.common.arrays import Bools, Floats
from zenocap.common.camera.pinhole import Camera
from zenocap.common.camera.validation import Z_UP_TO_Y_UP
from zenocap.simulation.rendering.camera import SimulatedCamera
from zenocap.tools.judge import rig_faults
from zenocap.tools.judge.evidence import evidence_of
from zenocap.tools.judge.rig_faults import Hypothesis, SeenRig


@pytest.mark.parametrize(
    ("shares", "stated"),
    [
        ({"one": 1.0, "two": 0.7}, "one"),
        ({"one": 0.9, "two": 1.0}, "two; or one"),
        ({"one": 1.0, "two": 0.95, "three": 0.9}, None),
        ({"one": 0.8}, None),
    ],
)
def test_two_orders_that_hold_about_as_often_are_both_stated(
    monkeypatch: pytest.MonkeyPatch, shares: Mapping[str, float], stated: str | None
) -> None:
    monkeypatch.setattr(SeenRig, "held", lambda _, one: np.array([shares[one.text]]))
    found = SeenRig({}, []).likeliest(Hypothesis("swapped", (text,), text, {}) for text in shares)
    assert (found and found.text) == stated
    assert found is None or set(found.viewers) == set(stated.split("; or ") if stated else ())


@pytest.mark.parametrize(("since", "timed"), [(3, False), (6, True), (12, True), (18, True), (21, None), (0, None)])
def test_a_camera_moved_within_a_take_is_found_from_a_quarter_to_three(
    monkeypatch: pytest.MonkeyPatch, since: int, timed: bool | None
) -> None:
    """Of 24 seconds: from then on the views agree only without it.  0: nobody is seen."""

    def held(rig: SeenRig, one: Hypothesis) -> Bools:
        agree = one.kind in ("", "one-view")
        return np.array([agree and (k < since * 10**9 or "cam02" not in one.films) for k, _ in rig.sets], dtype=np.bool_)

    monkeypatch.setattr(SeenRig, "held", held)
    monkeypatch.setattr(rig_faults, "frame_sets", lambda *_: [(k * 10**9, {}) for k in range(24 if since else 0)])
    found = rig_faults.rig_fault(evidence_of(built(m.CameraInfo, viewer=f"cam0{k}") for k in range(4)))
    when = f" from about {since} s on, not before" if timed else ", which agree"
    begin = None if timed is None else f"camera cam02 contradicts the others{when}"
    assert (found and found.text.partition(":")[0]) == begin


@cache
def shaded(views: int) -> tuple[tuple[Camera, tuple[m.Silhouette, ...]], ...]:
    """Cameras, and silhouettes of a person with a shadow that falls towards each, 4 a second."""
    one, found = walker(3, views, (160, 120), 14), []
    for name, camera in one.cameras.items():
        film, seen = SimulatedCamera(camera, one.person, 0), []
        for k in range(8):
            mask = np.asarray(film.silhouette(one.motion.pose_at(k / 4.0)) != 0, dtype=np.uint8)
            rows, columns = np.nonzero(mask)
            middle, end = int(columns[rows == rows.max()].mean()), rows.max() + round(0.25 * np.ptp(rows))
            mask[rows.max() : min(end, 118), middle - 1 : middle + 2] = 1
            seen.append(silhouette(name, k, k * 250_000_000, mask))
        found.append((camera, tuple(seen)))
    return tuple(found)


@pytest.mark.parametrize("views", [2, 3, 4])
@pytest.mark.parametrize(
    ("world_to_world", "unit", "words"),
    [
        (np.eye(3), 1.0, None),
        (Z_UP_TO_Y_UP, 1.0, "axis is Z, not Y"),
        (Z_UP_TO_Y_UP.T, 1.0, "axis is Y, not Z"),
        (np.diag([1.0, -1.0, -1.0]), 1.0, "axis points down"),
        (np.eye(3), 0.01, "in centimetres, not in metres"),
    ],
)
def test_axis_and_unit_are_named_although_shadows_lengthen_the_silhouettes(
    world_to_world: Floats, unit: float, words: str | None, views: int
) -> None:
    found: list[m.Message] = []
    for camera, seen in shaded(views):
        own = replace(camera, rotation=camera.rotation @ world_to_world, translation=camera.translation / unit)
        found += [camera_message(own), *seen]
    first = rig_faults.no_pose(evidence_of(found), None)[0]
    assert first.kind == ("calibration" if words else "no-pose"), first.text
    assert words is None or words in first.text
