"""Flashes and lamps in the brightness of videos."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.video_file import write_video
from tests.support.videos import grey_frames
from zenocap.common.arrays import Floats
from zenocap.common.lags.pairs import VideoOffset, offsets_of, reach_s
from zenocap.tools.setup.sync.light import FLASH_LIMITS, FlashPair, light_changes
from zenocap.tools.setup.sync.videos import Brightness, brightness_in, brightness_of

FPS, SECONDS, CELLS = 30.0, 5.0, 48
GREY = 40.0
LIMITS = replace(FLASH_LIMITS, max_lag_s=3.0)


def brightness(start_s: float, on_s: float, length_s: float, *, grey: float = GREY, cells: int = CELLS) -> Brightness:
    """Of a video that begins at `start_s`; a light shines from `on_s` on, for `length_s`, on the first `cells`.

    A person passes: each cell becomes brighter for a while, at another time.
    """
    rng = np.random.default_rng(round(1000 * start_s))
    times_s = np.arange(round(SECONDS * FPS)) / FPS
    since_s = times_s + start_s - on_s
    lit = np.clip(np.minimum(since_s + 1 / FPS, length_s) - np.maximum(since_s, 0.0), 0.0, None) * FPS
    values: Floats = 60.0 + rng.normal(0.0, 0.1, (len(times_s), CELLS))
    values[:, :cells] += grey * lit[:, None]
    passing = np.linspace(0.5, 4.5, CELLS)
    values += 30.0 * (np.abs(times_s[:, None] - passing) < 0.15)
    return Brightness(times_s, values)


def offset_of(starts_s: tuple[float, float], on_s: float, length_s: float, **options: float) -> VideoOffset:
    one, other = (light_changes(brightness(start_s, on_s, length_s, **options)) for start_s in starts_s)
    pairs = {("a", "b"): FlashPair(one, other, reach_s(3.0))} if one and other else {}
    return offsets_of(["a", "b"], pairs, LIMITS, {})["b"]


@pytest.mark.parametrize("offset_s", [-1.5, -0.413, 0.0, 0.021, 0.7, 2.0])
@pytest.mark.parametrize(("length_s", "flash"), [(1 / FPS, True), (2.4 / FPS, True), (100.0, False)])
def test_a_flash_and_a_lamp_give_the_offset_to_a_tenth_of_a_frame(offset_s: float, length_s: float, *, flash: bool) -> None:
    first_s = max(0.0, -offset_s)
    on_s = max(first_s, first_s + offset_s) + 1.617
    (change,) = light_changes(brightness(first_s, on_s, length_s))
    assert change.flash == flash
    found = offset_of((first_s, first_s + offset_s), on_s, length_s)
    assert not found.reason
    assert abs(found.offset_s - offset_s) < 0.1 / FPS


def test_a_flash_within_one_exposure_is_exact_to_a_frame_and_says_so() -> None:
    found = offset_of((0.0, 0.513), 2.2071, 0.001, grey=40.0 * 30)
    assert not found.reason
    assert abs(found.offset_s - 0.513) < 1 / FPS
    assert 0.3 / FPS < found.error_s < 0.6 / FPS


@pytest.mark.parametrize(("on_s", "options"), [(2.2, {"grey": 0.5}), (2.2, {"cells": 20}), (0.2, {}), (9.0, {})])
def test_weak_light_a_part_of_the_image_the_beginning_and_darkness_are_no_flash(
    on_s: float, options: dict[str, float]
) -> None:
    assert light_changes(brightness(0.0, on_s, 0.05, **options)) == []
    assert offset_of((0.0, 0.0), on_s, 0.05, **options).reason


def test_a_lamp_switched_on_is_not_taken_for_one_switched_off() -> None:
    on, off = (light_changes(brightness(0.0, 2.0, 100.0, grey=grey)) for grey in (GREY, -GREY))
    assert [one.strength > 0 for one in (*on, *off)] == [True, False]
    assert not FlashPair(on, off, 3.0).curve.values.any()


def test_the_weak_end_of_a_flash_is_no_flash_of_its_own() -> None:
    """In the second exposure is as much light as a change needs to be sudden."""
    (change,) = light_changes(brightness(0.0, 2.0 + 0.1 / FPS, 1.0 / FPS))
    assert abs(change.time_s - 2.0 - 0.1 / FPS) < 0.05 / FPS
    weak = brightness(0.0, 2.0, 1.0 / FPS)
    weak.cells[61] += 1.4  # less than LEAST_CHANGE remains
    weak.cells[62:] -= 0.2  # and more is gone in the next step
    (change,) = light_changes(weak)
    assert abs(change.time_s - 2.0) < 0.1 / FPS


def test_two_flashes_decide_between_their_distances() -> None:
    def two(start_s: float) -> Brightness:
        one, other = brightness(start_s, 2.0, 0.05), brightness(start_s, 3.1, 0.05)
        return replace(one, cells=one.cells + other.cells - 60.0)

    pairs = {("a", "b"): FlashPair(light_changes(two(0.0)), light_changes(two(0.4)), reach_s(3.0))}
    found = offsets_of(["a", "b"], pairs, LIMITS, {})["b"]
    assert not found.reason
    assert abs(found.offset_s - 0.4) < 0.1 / FPS


def test_brightness_of_files_has_their_times(tmp_path: Path) -> None:
    images = grey_frames(10)
    path = write_video(tmp_path / "one.mp4", images, [k / 20 for k in range(10)])
    found = brightness_in(path, 60.0)
    assert found.times_s == pytest.approx([k / 20 for k in range(10)])
    assert found.cells == pytest.approx(np.stack([brightness_of(image) for image in images]), abs=4.0)
    assert len(brightness_in(path, 0.2).times_s) == 5
