"""Live cameras whose images are given."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from tests.support.processes import PATIENCE_S
from zenocap.common.arrays import Image
from zenocap.common.rig.rig import Viewer
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.sources.playback import Playback
from zenocap.tools.setup.cameras.named_sources import named_sources
from zenocap.tools.setup.page.camera import LiveCamera

SIZE = (96, 64)
SILENT_S = 1.0


def picture(seed: int = 0, level: float = 120.0, noise: float = 3.0, size: tuple[int, int] = SIZE) -> Image:
    """A textured image, equal for all seeds but for the noise."""
    scene = np.kron(np.random.default_rng(99).uniform(-30, 30, (size[1] // 8, size[0] // 8, 3)), np.ones((8, 8, 1)))
    noisy = scene + level + np.random.default_rng(seed).normal(0, noise, scene.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def viewers(names: Sequence[str], fps: float = 30.0, size: tuple[int, int] = SIZE) -> list[Viewer]:
    return named_sources([f"{name}={number}" for number, name in enumerate(names)], size, fps)


def camera_of(images: Callable[[], Iterator[Frame | None]], name: str = "left", fps: float = 30.0) -> LiveCamera:
    """A camera with these frames; it is silent for a while where one is None."""
    (viewer,) = viewers([name], fps)

    def opened(_: Viewer, playback: Playback, *_others: object) -> Iterator[Frame]:
        for frame in images():
            if frame is None:
                playback.sleep(SILENT_S)
            else:
                yield frame

    return LiveCamera(viewer, 0, opener=opened)


@contextmanager
def running(*cameras: LiveCamera) -> Iterator[None]:
    """The cameras between start and stop."""
    for camera in cameras:
        camera.start()
    try:
        yield
    finally:
        for camera in cameras:
            camera.stop()


def paced(make: Callable[[int], Image], fps: float = 30.0, count: int | None = None) -> Iterator[Frame]:
    """Frames in real time, without end or `count` of them."""
    begin_ns, k = time.time_ns(), 0
    while count is None or k < count:
        due_ns = begin_ns + round(k * 1e9 / fps)
        time.sleep(max(0.0, (due_ns - time.time_ns()) / 1e9))
        yield Frame(k, due_ns, make(k))
        k += 1


def at_once(make: Callable[[int], Image], count: int, fps: float = 30.0) -> Iterator[Frame | None]:
    """`count` frames without waiting, of a source that is then silent for a while."""
    begin_ns = time.time_ns()
    for k in range(count):
        yield Frame(k, begin_ns + round(k * 1e9 / fps), make(k))
    yield None


def until(condition: Callable[[], bool], text: str = "", seconds: float = PATIENCE_S) -> None:
    """Wait for a state; text: of the error."""
    end_s = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end_s, text
        time.sleep(0.005)
