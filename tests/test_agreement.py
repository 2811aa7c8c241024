"""Agreement of the views: silence about good ones, and the right view and cause for every fault."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache

import cv2
import numpy as np
import pytest

from common.camera.pinhole import Camera
from common.vision.background import Mask
from services.tracker.agreement import EVERY, STEADY, Agreement, Finding, agreement, untrusted, watch
from services.tracker.hull import outlines
from tests.puppets import ring, silhouette, walker

FPS = 30.0
FRAMES = 190
BAD = 2

Masks = list[list[Mask]]  # view, frame


@lru_cache
def film(views: int, girth: float = 1.0) -> tuple[list[Camera], Masks]:
    cameras = ring(views)
    figures = [walker(k / FPS, girth) for k in range(FRAMES + 10)]
    return cameras, [[silhouette(camera, figure) for figure in figures] for camera in cameras]


def watched(cameras: Sequence[Camera], masks: Sequence[Sequence[Mask | None]]) -> list[tuple[Finding, ...]]:
    """The findings of every frame."""
    state: Agreement = agreement([camera.name for camera in cameras])
    said = []
    for frame in range(min(map(len, masks))):
        state, findings = watch(state, *outlines([mask[frame] for mask in masks], cameras, 200))
        said.append(findings)
    return said


def turned(camera: Camera, degrees: float) -> Camera:
    rotation = np.asarray(cv2.Rodrigues(np.array([0.0, np.radians(degrees), 0.0]))[0], dtype=np.float64)
    return replace(camera, rotation=rotation @ camera.rotation, translation=rotation @ camera.translation)


@pytest.mark.parametrize("girth", [0.8, 1.0, 1.3])
@pytest.mark.parametrize("views", [2, 3, 4, 7])
def test_nothing_is_said_of_views_that_agree(views: int, girth: float) -> None:
    assert set(watched(*film(views, girth))) == {()}


@pytest.mark.parametrize("views", [4, 5, 7])
@pytest.mark.parametrize("degrees", [2.0, -5.0])
def test_a_turned_camera_is_named(views: int, degrees: float) -> None:
    cameras, masks = film(views)
    wrong = [turned(camera, degrees) if k == BAD else camera for k, camera in enumerate(cameras)]
    said = watched(wrong, masks)
    assert {(f.kind, f.view) for findings in said for f in findings} == {("calibration", BAD)}
    (finding,) = said[-1]
    assert finding.figure > 0.1
    assert finding.text.startswith("view cam03 disagrees with the others: ")
    assert "of its outline has no support (others " in finding.text
    assert untrusted(said[-1]) == {BAD}


def test_a_moved_camera_is_named() -> None:
    cameras, masks = film(7)
    moved = replace(cameras[BAD], translation=cameras[BAD].translation + np.array([0.15, 0.0, 0.0]))
    said = watched([moved if k == BAD else camera for k, camera in enumerate(cameras)], masks)
    assert {(f.kind, f.view) for findings in said for f in findings} == {("calibration", BAD)}


@pytest.mark.parametrize("views", [4, 7])
@pytest.mark.parametrize("late", [-2, 2, 5])
def test_a_view_out_of_step_is_named_with_its_lag(views: int, late: int) -> None:
    cameras, masks = film(views)
    shifted = [mask[5 - late :] if k == BAD else mask[5:] for k, mask in enumerate(masks)]
    said = watched(cameras, shifted)
    (finding,) = said[-1]
    assert (finding.kind, finding.view, finding.figure) == ("out-of-step", BAD, late)
    assert f"view cam03 is out of step, {abs(late)} frames {'late' if late > 0 else 'early'}" in finding.text
    assert untrusted(said[-1]) == {BAD}


def test_a_frozen_view_is_named_within_its_time_and_trusted_again_when_it_moves() -> None:
    cameras, masks = film(4)
    since, until = 40, 100
    frozen = [*masks[BAD][:since], *[masks[BAD][since]] * (until - since), *masks[BAD][until:]]
    said = watched(cameras, [frozen if k == BAD else mask for k, mask in enumerate(masks)])
    named = [k for k, findings in enumerate(said) if ("frozen", BAD) in {(f.kind, f.view) for f in findings}]
    assert since + STEADY * EVERY - 1 <= named[0] <= since + (STEADY + 2) * EVERY
    assert until - 1 <= named[-1] <= until + 2 * EVERY
    assert "view cam03 is frozen" in said[named[0]][0].text


def test_everybody_standing_still_is_not_frozen() -> None:
    cameras, masks = film(4)
    assert set(watched(cameras, [[mask[50]] * FRAMES for mask in masks])) == {()}


def test_an_empty_view_is_named() -> None:
    cameras, masks = film(4)
    gone: list[Mask | None] = [*masks[BAD][:30], *[None] * (FRAMES - 30)]
    said = watched(cameras, [gone if k == BAD else mask for k, mask in enumerate(masks)])
    assert [(f.kind, f.view) for f in said[-1]] == [("empty", BAD)]
    assert "view cam03 has seen nobody for" in said[-1][0].text
    assert untrusted(said[-1]) == frozenset()


def test_who_walks_out_of_one_views_image_is_not_missed() -> None:
    cameras, masks = film(4)
    aside = replace(cameras[BAD], matrix=cameras[BAD].matrix + np.array([[0.0, 0.0, 400.0], [0.0] * 3, [0.0] * 3]))
    elsewhere: list[Mask | None] = [None] * FRAMES
    said = watched(
        [aside if k == BAD else camera for k, camera in enumerate(cameras)],
        [elsewhere if k == BAD else mask for k, mask in enumerate(masks)],
    )
    assert set(said) == {()}


def test_an_empty_room_is_nobodys_fault() -> None:
    cameras = ring(4)
    assert set(watched(cameras, [[None] * 60 for _ in cameras])) == {()}


@pytest.mark.parametrize("fault", [lambda camera: turned(camera, 5.0), lambda camera: camera], ids=["bad", "good"])
def test_the_same_input_gives_the_same_findings(fault: Callable[[Camera], Camera]) -> None:
    cameras, masks = film(4)
    wrong = [fault(camera) if k == BAD else camera for k, camera in enumerate(cameras)]
    assert watched(wrong, masks) == watched(wrong, masks)
