"""Speed of the vision stages on a textured scene with a person and a shadow.

Run with `--benchmark-only`.
"""

import cv2
import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from zenocap.common.arrays import Floats32, Image, Mask
from zenocap.common.vision.background import Background, gains, learn, update
from zenocap.common.vision.extraction import clean, extract
from zenocap.common.vision.foreground import ForegroundOptions, foreground
from zenocap.common.vision.mask_codec import pack, unpack
from zenocap.common.vision.silhouette import SilhouetteOptions

SIZES = ((160, 120), (640, 480))


@pytest.fixture(scope="module", params=SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
def scene(request: pytest.FixtureRequest) -> tuple[Background, Image, Mask]:
    """A learned background, a frame with a person of a third of the image height, and the person's mask."""
    cv2.setNumThreads(1)
    width, height = request.param
    rng = np.random.default_rng(1)
    coarse = rng.uniform(80, 200, (height // 12, width // 12, 3)).astype(np.float32)
    room = np.asarray(cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC), dtype=np.float32)
    person = np.zeros((height, width), dtype=np.uint8)
    u, middle = height / 120, width // 2
    for box in ((-6, 35, 12, 30), (-3, 25, 6, 9), (-26, 37, 52, 4), (-6, 65, 4, 30), (2, 65, 4, 30)):
        left, top, box_width, box_height = (round(u * v) for v in box)
        person[top : top + box_height, middle + left : middle + left + box_width] = 1
    shadow = np.zeros((height, width), dtype=np.uint8)
    cv2.ellipse(shadow, (middle, round(95 * u)), (round(25 * u), round(4 * u)), 0, 0, 360, 1, -1)
    image_with_person = np.where(shadow[..., None] > 0, 0.65 * room, room)
    image_with_person = np.where(
        person[..., None] > 0, np.array([70, 90, 180]) * (room[..., :1] / 300 + 0.5), image_with_person
    )

    image_with_person = np.asarray(image_with_person, dtype=np.float32)

    def noisy(image: Floats32) -> Image:
        return np.asarray(np.clip(image + rng.normal(0, 2, image.shape), 0, 255), dtype=np.uint8)

    return learn([noisy(room) for _ in range(20)]), noisy(image_with_person), person


def test_frame_to_silhouette(benchmark: BenchmarkFixture, scene: tuple[Background, Image, Mask]) -> None:
    background, frame, person = scene
    result = benchmark(extract, background, frame, SilhouetteOptions())
    assert result is not None
    assert np.count_nonzero(result.mask & person) > 0.9 * np.count_nonzero(result.mask | person)


def test_gains(benchmark: BenchmarkFixture, scene: tuple[Background, Image, Mask]) -> None:
    assert np.allclose(benchmark(gains, scene[0], scene[1]), 1, atol=0.02)


def test_foreground(benchmark: BenchmarkFixture, scene: tuple[Background, Image, Mask]) -> None:
    labels, _ = benchmark(foreground, scene[0], scene[1], ForegroundOptions(flicker=False))
    assert labels.any()


def test_clean(benchmark: BenchmarkFixture, scene: tuple[Background, Image, Mask]) -> None:
    labels, _ = foreground(scene[0], scene[1], ForegroundOptions(flicker=False))
    assert benchmark(clean, labels, SilhouetteOptions()) is not None


def test_update(benchmark: BenchmarkFixture, scene: tuple[Background, Image, Mask]) -> None:
    assert benchmark(update, *scene).size == scene[0].size


def test_pack(benchmark: BenchmarkFixture, scene: tuple[Background, Image, Mask]) -> None:
    region, data = benchmark(pack, scene[2])
    benchmark.extra_info["bytes"] = len(data)
    assert region[2] > 0


def test_unpack(benchmark: BenchmarkFixture, scene: tuple[Background, Image, Mask]) -> None:
    height, width = scene[2].shape
    assert np.array_equal(benchmark(unpack, (width, height), *pack(scene[2])), scene[2])
