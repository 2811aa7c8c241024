"""Ways to pack a silhouette without loss: bytes, and the time to pack and unpack.  Run with `--benchmark-only`.

The actor in the middle of a step, cut out by its box, 8 pixels a byte where it is bits.  `bytes` is in the extra info.
"""

import zlib
from collections.abc import Callable
from typing import NamedTuple

import cv2
import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from common.actor.person import person
from common.actor.pose import Placement
from common.actor.render import ActorCamera
from common.actor.walking import walk
from common.vision.background import Mask
from common.vision.packing import pack, unpack
from tests.actor_cameras import paper_cameras

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
    """Lengths of the runs of 0 and 1 in turns, row by row, 7 bits a byte, the highest bit on all but a length's last."""
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
    """The actor's mask of 0 and 1, cut out by its box."""
    cv2.setNumThreads(1)
    somebody = person(0)
    way = [Placement(0.0, 0.4 * k, 0.0) for k in range(1, 4)]
    camera = ActorCamera(paper_cameras(request.param)[1], somebody, 0)
    mask = camera.silhouette(walk(somebody, way, 0.6).pose_at(0.9))
    left, top, across, down = cv2.boundingRect(mask)
    return np.ascontiguousarray(mask[top : top + down, left : left + across] // 255)


@pytest.mark.parametrize("packing", PACKINGS, ids=lambda packing: packing.name)
def test_packing(benchmark: BenchmarkFixture, silhouette: Mask, packing: Packing) -> None:
    data = benchmark(packing.pack, silhouette)
    benchmark.extra_info["bytes"] = len(data)
    assert np.array_equal(packing.unpack(data, silhouette.shape), silhouette)


@pytest.mark.parametrize("packing", PACKINGS, ids=lambda packing: packing.name)
def test_unpacking(benchmark: BenchmarkFixture, silhouette: Mask, packing: Packing) -> None:
    data = packing.pack(silhouette)
    assert np.array_equal(benchmark(packing.unpack, data, silhouette.shape), silhouette)


def test_ours_is_the_smallest_but_for_what_costs_more(silhouette: Mask) -> None:
    """The choice: smaller than PNG and any zlib over rows, within a quarter of run lengths in zlib."""
    size = {packing.name: len(packing.pack(silhouette)) for packing in PACKINGS}
    assert size["ours"] < min(size["1-bit PNG"], size["zlib 1"], size["zlib 9"], size["runs"])
    assert size["ours"] < 1.25 * size["runs, zlib 6"]
