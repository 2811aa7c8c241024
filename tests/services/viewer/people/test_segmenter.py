"""Places and times of the network's runs, without the network itself."""

from threading import Event

import numpy as np
import pytest

from zenocap.common.arrays import Floats32, Image
from zenocap.common.errors import UserError
from zenocap.common.vision.semantics import NOT_PERSON, PERSON
from zenocap.common.vision.silhouette import Extents
from zenocap.services.viewer.frame import Frame
from zenocap.services.viewer.people.network import load_network
from zenocap.services.viewer.people.segmenter import PeopleSegmenter, Square, around, cut, tiles

SIZE = (160, 120)
PERIOD_NS = 300


def bright(picture: Image) -> Floats32:
    """Stand-in for the network: bright pixels are a person."""
    return (picture[..., 0] > 128).astype(np.float32)


def frame(captured_ns: int) -> Frame:
    image = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
    image[30:90, 70:90] = 200
    return Frame(captured_ns, captured_ns, image)


@pytest.mark.parametrize("size", [(160, 120), (120, 160), (640, 480), (96, 96), (641, 363)])
def test_the_tiles_cover_the_image_and_are_inside(size: tuple[int, int]) -> None:
    covered = {side: np.zeros(size[::-1], bool) for side in (min(size), min(size) // 2)}
    for tile in tiles(size):
        left, top, right, bottom = tile.inside(size)
        assert (right - left, bottom - top) == (tile.side, tile.side)
        covered[tile.side][top:bottom, left:right] = True
    assert all(one.all() for one in covered.values())


def test_the_square_around_a_person_holds_the_person_and_is_in_the_image_where_it_fits() -> None:
    square = around(Extents(0, 20, 30, 90), SIZE)
    assert square.left == 0
    assert square.top <= 30
    assert square.top + square.side > 90
    assert around(Extents(0, 20, 0, 119), SIZE).side > SIZE[1]


def test_a_square_beyond_the_border_repeats_the_border() -> None:
    image = np.arange(3 * 4 * 4, dtype=np.uint8).reshape(4, 4, 3)
    part = cut(image, Square(-1, -1, 6))
    assert part.shape == (6, 6, 3)
    assert (part[1:5, 1:5] == image).all()
    assert (part[0, 0] == image[0, 0]).all()


def test_offline_the_network_is_asked_at_fixed_times() -> None:
    asked: list[int] = []

    def find(picture: Image) -> Floats32:
        asked.append(picture.shape[0])
        return bright(picture)

    segmenter = PeopleSegmenter(find, threaded=False, period_ns=PERIOD_NS)
    results = [segmenter.latest(frame(k), None, Extents(70, 89, 30, 89)) for k in range(0, 700, 100)]
    assert [one.captured_ns for one in results if one is not None] == [0, 0, 0, 300, 300, 300, 600]
    assert len(asked) == 3
    last = results[-1]
    assert last.verdict[60 - last.top, 80 - last.left] == PERSON
    assert last.verdict[60 - last.top, 45 - last.left] == NOT_PERSON


def test_without_a_person_the_tiles_are_searched_in_turn() -> None:
    segmenter = PeopleSegmenter(bright, threaded=False, period_ns=1)
    count = len(tiles(SIZE))
    found = [segmenter.latest(frame(k), None, None) for k in range(count + 1)]
    places = [(one.left, one.top, one.verdict.shape[0]) for one in found if one is not None]
    assert places == [(t.left, t.top, t.side) for t in (*tiles(SIZE), tiles(SIZE)[0])]


def test_live_no_frame_waits_for_the_network() -> None:
    go = Event()

    def slow(picture: Image) -> Floats32:
        assert go.wait(30)
        return bright(picture)

    segmenter = PeopleSegmenter(slow, threaded=True, period_ns=1)
    try:
        assert [segmenter.latest(frame(k), None, None) for k in range(3)] == [None] * 3
    finally:
        go.set()
        segmenter.close()
    segmenter._period_ns = 10**9  # the thread has ended: its result is there, and no other is asked for within the period
    assert segmenter.latest(frame(3), None, None).captured_ns == 0


def test_a_missing_model_is_one_error_with_the_command(monkeypatch: pytest.MonkeyPatch, tmp_path: str) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    with pytest.raises(UserError, match="`zenocap models add people` gets it"):
        load_network()
