"""Speed of the vision stages on a simulated room with a person.

Run with `--benchmark-only`.
"""

import cv2
import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from tests.support.walkers import walker
from zenocap.common.arrays import Image, Mask
from zenocap.common.vision.background import Background, gains, learn, update
from zenocap.common.vision.extraction import clean, extract
from zenocap.common.vision.foreground import ForegroundOptions, foreground
from zenocap.common.vision.mask_codec import pack, unpack
from zenocap.common.vision.silhouette import SilhouetteOptions
from zenocap.simulation.rendering.camera import SimulatedCamera

SIZES = ((160, 120), (640, 480))


@pytest.fixture(scope="module", params=SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
def scene(request: pytest.FixtureRequest) -> tuple[Background, Image, Mask]:
    """A learned background, a frame with a person, and the person's mask."""
    cv2.setNumThreads(1)
    one = walker(3, 1, request.param)
    film, pose = SimulatedCamera(one.cameras["cam01"], one.person, 1), one.motion.pose_at(1.0)
    person = np.asarray(film.silhouette(pose) != 0, dtype=np.uint8)
    return learn([film.render(None, k) for k in range(20)]), film.render(pose, 20), person


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
