"""View consistency: no finding for good views, and the correct view and cause for every fault."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import lru_cache

import cv2
import numpy as np
import pytest

from tests.support.puppets import ring, silhouette, walker
from zenocap.common.arrays import Mask
from zenocap.common.camera.pinhole import Camera
from zenocap.services.tracker.hull.contour_rays import extract_outlines
from zenocap.services.tracker.view_check.view_consistency import (
    Finding,
    check_views,
    initial_consistency,
    untested_lags,
    untrusted,
)

pytestmark = pytest.mark.slow
FPS = 30.0
FRAMES = 190
BAD = 2

Masks = list[list[Mask]]  # view, frame


@lru_cache
def film(views: int, girth: float = 1.0) -> tuple[list[Camera], Masks]:
    cameras = ring(views)
    figures = [walker(k / FPS, girth) for k in range(FRAMES + 10)]
    return cameras, [[silhouette(camera, figure) for figure in figures] for camera in cameras]


def findings_of(cameras: Sequence[Camera], masks: Sequence[Sequence[Mask | None]]) -> list[tuple[Finding, ...]]:
    """Findings of every frame."""
    state, results = initial_consistency([camera.name for camera in cameras]), []
    for frame in range(min(map(len, masks))):
        outlines = extract_outlines([mask[frame] for mask in masks], cameras, 200)
        state, findings = check_views(state, round(frame * 1e9 / FPS), *outlines)
        results.append(findings)
    return results


def with_bad(cameras: Sequence[Camera], other: Camera) -> list[Camera]:
    """The cameras, one of them replaced."""
    return [other if k == BAD else camera for k, camera in enumerate(cameras)]


def named(results: Iterable[tuple[Finding, ...]]) -> set[tuple[str, int]]:
    """Kinds and views of all findings."""
    return {(finding.kind, finding.view) for findings in results for finding in findings}


def turned(camera: Camera, degrees: float) -> Camera:
    rotation = np.asarray(cv2.Rodrigues(np.array([0.0, np.radians(degrees), 0.0]))[0], dtype=np.float64)
    return replace(camera, rotation=rotation @ camera.rotation, translation=rotation @ camera.translation)


@pytest.mark.nightly
@pytest.mark.parametrize("girth", [0.8, 1.0, 1.3])
@pytest.mark.parametrize("views", [2, 3, 4, 7])
def test_consistent_views_give_no_finding(views: int, girth: float) -> None:
    assert set(findings_of(*film(views, girth))) == {()}


@pytest.mark.nightly
@pytest.mark.parametrize("views", [4, 5, 7])
@pytest.mark.parametrize("degrees", [2.0, -5.0])
def test_turned_camera_is_reported(views: int, degrees: float) -> None:
    cameras, masks = film(views)
    results = findings_of(with_bad(cameras, turned(cameras[BAD], degrees)), masks)
    assert named(results) == {("calibration", BAD)}
    (finding,) = results[-1]
    assert int(re.match(r"view cam03 disagrees with the others: (\d+) %", finding.text)[1]) > 10
    assert "of its contour lacks support (others " in finding.text
    assert untrusted(results[-1]) == {BAD}


@pytest.mark.nightly
def test_moved_camera_is_reported() -> None:
    cameras, masks = film(7)
    moved = replace(cameras[BAD], translation=cameras[BAD].translation + np.array([0.15, 0.0, 0.0]))
    assert named(findings_of(with_bad(cameras, moved), masks)) == {("calibration", BAD)}


@pytest.mark.nightly
@pytest.mark.parametrize("views", [4, 7])
@pytest.mark.parametrize("late", [-2, 2, 5])
def test_view_out_of_step_is_reported_with_its_lag(views: int, late: int) -> None:
    cameras, masks = film(views)
    shifted = [mask[5 - late :] if k == BAD else mask[5:] for k, mask in enumerate(masks)]
    results = findings_of(cameras, shifted)
    (finding,) = results[-1]
    assert named([(finding,)]) == {("out-of-step", BAD)}
    assert f"view cam03 is out of step, {abs(late)} frames {'late' if late > 0 else 'early'}" in finding.text
    assert untrusted(results[-1]) == {BAD}


@pytest.mark.nightly
def test_view_that_was_out_of_step_is_used_at_once_when_its_lag_is_tested_anew() -> None:
    cameras, masks = film(7)
    outlines = [
        extract_outlines([mask[k - 3 if view == BAD and k < 150 else k] for view, mask in enumerate(masks)], cameras, 200)
        for k in range(3, FRAMES)
    ]
    state = initial_consistency([camera.name for camera in cameras])
    for k, one in enumerate(outlines[:147]):
        state, findings = check_views(state, round(k * 1e9 / FPS), *one)
    assert untrusted(findings) == {BAD}
    corrected, late = untested_lags(state), state
    for k, one in enumerate(outlines[147:], 147):
        corrected, findings = check_views(corrected, round(k * 1e9 / FPS), *one)
        late, as_before = check_views(late, round(k * 1e9 / FPS), *one)
    assert untrusted(findings) == frozenset()
    assert untrusted(as_before) == {BAD}


@pytest.mark.nightly
@pytest.mark.parametrize("views", [2, 4])
def test_frozen_view_is_reported_in_time_and_used_again_when_it_changes(views: int) -> None:
    cameras, masks = film(views)
    bad, since, until = views - 2, 40, 100
    frozen = [*masks[bad][:since], *[masks[bad][since]] * (until - since), *masks[bad][until:]]
    results = findings_of(cameras, [frozen if k == bad else mask for k, mask in enumerate(masks)])
    assert named(results) == {("frozen", bad)}
    frames = [k for k, findings in enumerate(results) if findings]
    assert since + 0.25 * FPS <= frames[0] <= since + 0.3 * FPS
    assert frames == list(range(frames[0], until))
    assert f"view cam{bad + 1:02d} is frozen" in results[frames[0]][0].text
    assert untrusted(results[frames[0]]) == {bad}


@pytest.mark.nightly
@pytest.mark.parametrize("each", [2, 4])
def test_a_camera_of_half_or_a_quarter_of_the_rate_is_not_frozen(each: int) -> None:
    cameras, masks = film(4)
    slow = [masks[BAD][k - k % each] for k in range(FRAMES)]
    results = findings_of(cameras, [slow if k == BAD else mask for k, mask in enumerate(masks)])
    assert "frozen" not in {kind for kind, _ in named(results)}


@pytest.mark.nightly
@pytest.mark.parametrize("standing", [FRAMES, 100])
def test_a_person_standing_still_is_not_a_frozen_view(standing: int) -> None:
    """Also not where the person then moves."""
    cameras, masks = film(4)
    assert set(findings_of(cameras, [[mask[50]] * standing + mask[50 : 50 + FRAMES - standing] for mask in masks])) == {()}


def test_empty_view_is_reported() -> None:
    cameras, masks = film(4)
    with_loss: list[Mask | None] = [*masks[BAD][:30], *[None] * (FRAMES - 30)]
    results = findings_of(cameras, [with_loss if k == BAD else mask for k, mask in enumerate(masks)])
    assert named(results[-1:]) == {("empty", BAD)}
    assert "view cam03 is empty for" in results[-1][0].text
    assert untrusted(results[-1]) == frozenset()


@pytest.mark.nightly
def test_a_view_that_never_sees_the_person_gives_no_finding() -> None:
    cameras, masks = film(4)
    aside = replace(cameras[BAD], matrix=cameras[BAD].matrix + np.array([[0.0, 0.0, 400.0], [0.0] * 3, [0.0] * 3]))
    never = [[None] * FRAMES if k == BAD else mask for k, mask in enumerate(masks)]
    assert set(findings_of(with_bad(cameras, aside), never)) == {()}


def test_an_empty_scene_gives_no_finding() -> None:
    cameras = ring(4)
    assert set(findings_of(cameras, [[None] * 60 for _ in cameras])) == {()}


@pytest.mark.parametrize("degrees", [5.0, 0.0], ids=["bad", "good"])
def test_same_input_gives_the_same_findings(degrees: float) -> None:
    cameras, masks = film(4)
    wrong = with_bad(cameras, turned(cameras[BAD], degrees))
    assert findings_of(wrong, masks) == findings_of(wrong, masks)
