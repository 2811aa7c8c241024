"""Lossless encodings of a silhouette: size, and time to pack and unpack.  Run with `--benchmark-only`.

The simulated person in the middle of a step, cropped to its bounding box; bit masks have 8 pixels per byte.  `bytes` is
in the extra info.
"""

import zlib
from collections.abc import Callable
from typing import NamedTuple

import cv2
import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from tests.support.simulated_cameras import paper_cameras
from zenocap.common.arrays import Mask
from zenocap.common.vision.mask_codec import pack, unpack
from zenocap.simulation.body.person import person
from zenocap.simulation.body.pose import Placement
from zenocap.simulation.motion.footsteps import walk
from zenocap.simulation.rendering.camera import SimulatedCamera

SIZES = ((160, 120), (640, 480))


class Packing(NamedTuple):
    name: str
    pack: Callable[[Mask], bytes]
    unpack: Callable[[bytes, tuple[int, int]], Mask]  # of bytes and (height, width)


def rows(mask: Mask) -> bytes:
    return np.packbits(mask, axis=1).tobytes()


def mask_of(bits: bytes, shape: tuple[int, int]) -> Mask:
    packed = np.frombuffer(bits, dtype=np.uint8).reshape(shape[0], -1)
    return np.unpackbits(packed, axis=1, count=shape[1])


def runs(mask: Mask) -> bytes:
    """Run lengths of 0 and 1 alternately, row by row, as little-endian base-128 numbers."""
    ends = np.flatnonzero(np.diff(np.concatenate([[0], mask.ravel()])))
    out = bytearray()
    for length in np.diff(np.concatenate([[0], ends])).tolist():
        while length >= 128:
            out.append(128 | length & 127)
            length >>= 7
        out.append(length)
    return bytes(out)


def mask_of_runs(data: bytes, shape: tuple[int, int]) -> Mask:
    lengths, length, shift = [], 0, 0
    for byte in data:
        length |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            lengths.append(length)
            length, shift = 0, 0
    lengths.append(shape[0] * shape[1] - sum(lengths))
    return np.repeat(np.arange(len(lengths)) % 2, lengths).astype(np.uint8).reshape(shape)


def png(mask: Mask) -> bytes:
    return bytes(cv2.imencode(".png", mask * 255, [cv2.IMWRITE_PNG_BILEVEL, 1, cv2.IMWRITE_PNG_COMPRESSION, 1])[1])


def mask_of_png(data: bytes, _: tuple[int, int]) -> Mask:
    image = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_GRAYSCALE)
    return np.asarray(image, dtype=np.uint8) // 255


def zlib_rows(level: int) -> Packing:
    return Packing(
        f"zlib {level}",
        lambda mask: zlib.compress(rows(mask), level),
        lambda data, shape: mask_of(zlib.decompress(data), shape),
    )


PACKINGS = (
    Packing("1-bit PNG", png, mask_of_png),
    *(zlib_rows(level) for level in (1, 6, 9)),
    Packing("runs", runs, mask_of_runs),
    Packing(
        "runs, zlib 6",
        lambda mask: zlib.compress(runs(mask), 6),
        lambda data, shape: mask_of_runs(zlib.decompress(data), shape),
    ),
    Packing("ours", lambda mask: pack(mask)[1], lambda data, shape: unpack(shape[::-1], (0, 0, *shape[::-1]), data)),
)


@pytest.fixture(scope="module", params=SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
def silhouette(request: pytest.FixtureRequest) -> Mask:
    """Mask (0 or 1) of the simulated person, cropped to its bounding box."""
    cv2.setNumThreads(1)
    subject = person(0)
    path = [Placement(0.0, 0.4 * k, 0.0) for k in range(1, 4)]
    camera = SimulatedCamera(paper_cameras(request.param)[1], subject, 0)
    mask = camera.silhouette(walk(subject, path, 0.6).pose_at(0.9))
    left, top, box_width, box_height = cv2.boundingRect(mask)
    return np.ascontiguousarray(mask[top : top + box_height, left : left + box_width] // 255)


@pytest.mark.parametrize("packing", PACKINGS, ids=lambda packing: packing.name)
def test_packing(benchmark: BenchmarkFixture, silhouette: Mask, packing: Packing) -> None:
    data = benchmark(packing.pack, silhouette)
    benchmark.extra_info["bytes"] = len(data)
    assert np.array_equal(packing.unpack(data, silhouette.shape), silhouette)


@pytest.mark.parametrize("packing", PACKINGS, ids=lambda packing: packing.name)
def test_unpacking(benchmark: BenchmarkFixture, silhouette: Mask, packing: Packing) -> None:
    data = packing.pack(silhouette)
    assert np.array_equal(benchmark(packing.unpack, data, silhouette.shape), silhouette)


def test_our_encoding_is_smaller_than_png_and_zlib(silhouette: Mask) -> None:
    """Smaller than PNG and any zlib of rows, and at most a quarter larger than zlib of run lengths."""
    size = {packing.name: len(packing.pack(silhouette)) for packing in PACKINGS}
    assert size["ours"] < min(size["1-bit PNG"], size["zlib 1"], size["zlib 9"], size["runs"])
    assert size["ours"] < 1.25 * size["runs, zlib 6"]
