"""Background models: learning, ignored changes, immutability."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from zenocap.common.arrays import Floats, Image
from zenocap.common.vision.background import LIMIT_GAIN, Background, from_image, gains, learn, learn_median, update


def room(height: int = 60, width: int = 80) -> Floats:
    y, x = np.mgrid[0:height, 0:width]
    grey = 120 + 25 * np.sin(x / 7) + 25 * np.cos(y / 5)
    return np.stack([grey, grey * 0.95, grey * 1.05], axis=-1)


def shot(scene: Floats, seed: int, sigma: float = 2.0) -> Image:
    noise = np.random.default_rng(seed).normal(0, sigma, scene.shape)
    return np.clip(np.rint(scene + noise), 0, 255).astype(np.uint8)


def black(height: int, width: int) -> Image:
    return np.zeros((height, width, 3), np.uint8)


def test_mean_and_noise_are_learnt() -> None:
    background = learn([shot(room(), k) for k in range(40)])
    assert np.abs(background.mean - room()).mean() < 0.4
    assert 2.0 < np.median(background.sigma()) < 3.2  # the noise, and 1 % of the brightness


def test_the_estimated_noise_has_a_lower_limit() -> None:
    assert learn([room().astype(np.uint8)] * 5).sigma().min() >= 0.5


def test_one_frame_is_enough() -> None:
    assert np.array_equal(learn([shot(room(), 0)]).mean, shot(room(), 0).astype(np.float32))


def test_median_ignores_a_person_who_passes() -> None:
    frames = [shot(room(), k) for k in range(30)]
    for k, frame in enumerate(frames):
        frame[20:50, 2 * k : 2 * k + 12] = 10
    assert np.abs(learn_median(frames).mean - room())[20:50].max() < 4
    assert np.abs(learn(frames).mean - room())[20:50].max() > 20


REFUSED = {
    "mean of no frames": (lambda: learn([]), "0 frames"),
    "median of no frames": (lambda: learn_median([]), "0 frames"),
    "mean of two shapes": (lambda: learn([black(4, 5), black(5, 4)]), "frames of shapes"),
    "median of two shapes": (lambda: learn_median([black(4, 5), black(5, 4)]), "frames of shapes"),
    "picture of another shape": (lambda: from_image(black(60, 64), [black(60, 80)]), "64x60 against frames of 80x60"),
    "update, another shape": (lambda: update(learn([black(8, 9)]), black(9, 8), None), r"the background's is \(8, 9, 3\)"),
    "rate": (lambda: update(learn([black(8, 9)]), black(8, 9), None, 1.5), r"rate: 1\.5; allowed 0 to 1"),
}


@pytest.mark.parametrize(("call", "message"), REFUSED.values(), ids=REFUSED)
def test_unusable_input_is_refused(call: Callable[[], Background], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()


def test_a_background_image_gets_exposure_and_noise_from_frames_with_a_person() -> None:
    frames = [shot(0.9 * room(), k, 3.0) for k in range(4)]
    for frame in frames:
        frame[10:50, 30:45] = (20, 200, 20)
    background = from_image(room().astype(np.uint8), frames)
    assert np.abs(background.mean / (0.9 * room()) - 1).mean() < 0.01
    assert 2.5 < np.median(background.sigma()) < 4.5


def test_a_slightly_smaller_background_image_is_resized() -> None:
    frame = shot(room(200, 300), 0)
    assert from_image(room(198, 297).astype(np.uint8), [frame]).size == (300, 200)


@pytest.mark.slow
@given(st.floats(0.7, 1.3), st.floats(0.85, 1.15))
@settings(max_examples=20)
def test_gain_is_the_ratio_of_light_even_with_a_person_in_view(light: float, blue: float) -> None:
    factor = np.array([light * blue, light, light])
    frame = shot(room() * factor, 3)
    frame[10:50, 30:50] = 15
    assert np.allclose(gains(learn([shot(room(), k) for k in range(8)]), frame), factor, rtol=0.02)


def test_gain_is_one_for_a_dark_scene() -> None:
    dark = np.full((40, 40, 3), 3, dtype=np.uint8)
    assert np.array_equal(gains(learn([dark] * 3), dark), np.ones(3))


def test_gain_ignores_the_pixels_of_the_person() -> None:
    frame, person = shot(room(), 1), np.zeros((60, 80), dtype=np.uint8)
    frame[:, 20:], person[:, 20:] = 60, 1
    assert np.allclose(gains(learn([shot(room(), 0)]), frame, person), 1, atol=0.03)


def test_update_follows_the_light_but_not_the_person() -> None:
    before = learn([shot(room(), k) for k in range(8)])
    frame, person = shot(room() + 10, 9), np.zeros((60, 80), dtype=np.uint8)
    frame[20:40, 30:40], person[20:40, 30:40] = 0, 1
    kept, after = before.mean.copy(), before
    for _ in range(60):
        after = update(after, frame, person, rate=0.1)
    assert np.allclose(after.mean[:15], frame[:15], atol=0.2)
    assert np.array_equal(after.mean[18:42, 28:42], before.mean[18:42, 28:42])  # the person and a margin of 2 px
    assert np.array_equal(before.mean, kept)  # immutable: the old model has not changed


def test_update_without_a_person_moves_all_pixels_by_the_rate() -> None:
    before = learn([np.full((8, 8, 3), 100, np.uint8)])
    assert np.allclose(update(before, np.full((8, 8, 3), 120, np.uint8), None, 0.25).mean, 105)


def test_learning_is_repeatable() -> None:
    frames = [shot(room(), k) for k in range(6)]
    first, second = learn(frames), learn(frames)
    assert isinstance(first, Background)
    assert first.mean.tobytes() == second.mean.tobytes()
    assert first.weight.tobytes() == second.weight.tobytes()


@pytest.mark.slow
@given(st.integers(0, 2**32 - 1), st.floats(0.5, 2.0), st.floats(1.0, 20.0))
@settings(max_examples=60)
def test_pixels_within_the_limits_are_near_the_model_at_every_gain_they_hold_for(
    seed: int, middle: float, sigmas: float
) -> None:
    rng = np.random.default_rng(seed)
    mean = rng.uniform(0, 255, (7, 13, 3)).astype(np.float32)
    weight = (1 / rng.uniform(0.5, 20, mean.shape) ** 2).astype(np.float32)
    gain = np.full(3, middle, dtype=np.float32)
    limits = Background(mean, weight).limits(gain, sigmas)
    for level in (limits.low, limits.high):
        for change in (-0.99, 0.99):
            difference = level - (gain + np.float32(change * LIMIT_GAIN)) * mean
            near = (difference * difference * weight).sum(axis=2) < sigmas**2
            assert near[(limits.low <= limits.high).all(axis=2)].all()


def test_limits_are_kept_until_gain_distance_or_model_change() -> None:
    background, frame = learn([shot(room(), k) for k in range(5)]), shot(room(), 9)
    one = np.ones(3, dtype=np.float32)
    limits = background.limits(one, 5.0)
    assert background.limits(one + np.float32(0.5 * LIMIT_GAIN), 5.0) is limits
    assert background.limits(one + np.float32(2 * LIMIT_GAIN), 5.0) is not limits
    assert background.limits(one, 4.0).sigmas == 4.0
    later = update(background, frame, None)
    assert not np.array_equal(later.limits(one, 5.0).low, limits.low)
