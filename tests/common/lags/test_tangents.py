"""Lags from tangent planes of silhouettes."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.moving_balls import FPS, mask_of, ring
from zenocap.common.camera.pinhole import Camera
from zenocap.common.lags.pairs import VideoOffset, offsets_of, reach_s
from zenocap.common.lags.tangents import SILHOUETTE_LIMITS, Outline, baseline_of, outline_of, silhouette_pairs, tangents


def film(camera: Camera, start_s: float, count: int = 180, fps: float = FPS, *, still: bool = False) -> list[Outline]:
    every = (outline_of(camera, mask_of(camera, start_s + k / fps, still=still), k / fps) for k in range(count))
    return [one for one in every if one is not None]


def offsets(
    cameras: dict[str, Camera], outlines: dict[str, list[Outline]], max_lag_s: float = 3.0
) -> dict[str, VideoOffset]:
    pairs = silhouette_pairs(cameras, outlines, reach_s(max_lag_s))
    return offsets_of(list(cameras), pairs, replace(SILHOUETTE_LIMITS, max_lag_s=max_lag_s), {})


def test_tangent_planes_of_both_views_are_equal_at_equal_times() -> None:
    one, two = ring((0, 90)).values()
    one, two = one.resized((1280, 960)), two.resized((1280, 960))
    baseline = baseline_of(one, two, np.array([0.0, 1.0, 0.0]))
    first, second = (tangents(film(camera, 0.0, 20), baseline) for camera in (one, two))
    a, b, noise = first.angles, second.angles, first.noise(1 / 1200)
    assert np.abs(a - b).max() < 3 * noise
    assert np.abs(a[0] - b[-1]).max() > 10 * noise


def test_a_tangent_at_the_border_of_the_image_is_left_out() -> None:
    one, two = ring((0, 90)).values()
    mask = mask_of(one, 0.0)
    cut = np.roll(mask, -np.flatnonzero(mask.any(axis=1))[0], axis=0)  # the head is at the upper border
    baseline = baseline_of(one, two, np.array([0.0, 1.0, 0.0]))
    assert np.isnan(tangents([outline_of(one, cut, 0.0)], baseline).angles).sum() == 1


def test_cameras_on_a_line_with_the_person_have_no_baseline() -> None:
    one, two = ring((0, 180)).values()
    assert baseline_of(one, two, np.array([0.0, 1.0, 0.0])) is None
    assert baseline_of(one, one, np.array([0.0, 1.0, 0.0])) is None


@pytest.mark.nightly
@pytest.mark.parametrize("shift_s", [0.0, 0.5 / FPS, 0.71, -1.234])
def test_offsets_of_a_moving_body_are_exact_to_a_tenth_of_a_frame(shift_s: float) -> None:
    cameras = ring((0, 90, 40))
    starts = {"cam01": 2.0, "cam02": 2.0 + shift_s, "cam03": 2.3}
    outlines = {name: film(camera, starts[name]) for name, camera in cameras.items()}
    for name, offset in offsets(cameras, outlines).items():
        assert not offset.reason
        assert abs(offset.offset_s - starts[name] + 2.0) < 0.1 / FPS


@pytest.mark.slow
def test_different_frame_rates_are_compared() -> None:
    cameras = ring((0, 90))
    outlines = {"cam01": film(cameras["cam01"], 0.0), "cam02": film(cameras["cam02"], 0.4, 300, 50.0)}
    found = offsets(cameras, outlines)["cam02"]
    assert not found.reason
    assert abs(found.offset_s - 0.4) < 0.15 / FPS


@pytest.mark.nightly
def test_a_still_body_and_an_offset_beyond_the_range_are_not_certain() -> None:
    cameras = ring((0, 90))
    outlines = {name: film(camera, 0.0, still=True) for name, camera in cameras.items()}
    assert offsets(cameras, outlines)["cam02"].reason
    outlines = {name: film(camera, start) for (name, camera), start in zip(cameras.items(), (0.0, 1.5), strict=True)}
    assert "--max-offset" in offsets(cameras, outlines, 1.0)["cam02"].reason
