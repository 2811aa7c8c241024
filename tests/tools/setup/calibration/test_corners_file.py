"""Corner files: views of the film bit for bit; damaged files refused."""

import shutil
from copy import deepcopy
from dataclasses import replace
from functools import reduce
from operator import getitem
from pathlib import Path

import msgspec
import numpy as np
import pytest

from tests.support.board_pictures import before, board_video, picture_folder, picture_of, plain_camera
from zenocap.common.errors import UserError
from zenocap.tools.setup.calibration.board import Board, checked_board
from zenocap.tools.setup.calibration.board_films import board_films, board_views, searchable_films
from zenocap.tools.setup.calibration.board_views import CameraViews, View
from zenocap.tools.setup.calibration.corners_file import FORMAT, packed, parsed, read_corners, write_corners
from zenocap.tools.setup.calibration.detection import detected

BOARD = checked_board("charuco", 5, 6, 35.0)  # even rows: with an older pattern
OLD = next(one for one in BOARD.variants() if one.legacy and not one.inverted)
CAMERA = plain_camera((320, 240), 300.0)
FPS, FRAMES = 10, 8


def pictures(board: Board, x: float = 0.0, z: float = 0.5):
    """The board moves to the right and turns a little."""
    poses = [before(board, z, (0.2, 0.1, 0.02 * k), (x + 0.006 * (k - FRAMES / 2), 0.0)) for k in range(FRAMES)]
    return [picture_of(board, CAMERA, pose, seed) for seed, pose in enumerate(poses)]


@pytest.fixture(scope="module")
def films(tmp_path_factory) -> Path:
    """Two cameras see a board of the older pattern, cam01 at the border of its image; they began at different times."""
    folder = tmp_path_factory.mktemp("films")
    board_video(folder / "videos" / "cam01.mp4", [*pictures(OLD, 0.19), np.full((240, 320), 150, np.uint8)], FPS)
    board_video(folder / "videos" / "cam02.mp4", pictures(OLD), FPS)
    (folder / "sync.toml").write_text("[offset_s]\ncam01 = 0.0\ncam02 = -0.123\n")
    return folder


@pytest.fixture(scope="module")
def corners(films, tmp_path_factory) -> Path:
    """The same folder with the corners in place of the videos."""
    folder = tmp_path_factory.mktemp("corners")
    shutil.copy(films / "sync.toml", folder)
    for film in searchable_films([films]):
        write_corners(folder / "corners" / f"{film.name}.corners", detected(BOARD, film.path, film.name))
    return folder


def exact(board: Board, seen: list[CameraViews]) -> list[object]:
    """All that is seen, with the bytes of arrays."""

    def arrays(view: View) -> list[object]:
        return [view.time_s, *((one.dtype, one.shape, one.tobytes()) for one in (view.ids, view.pixels, view.velocities))]

    return [board, *((replace(one, views=()), one.coverage, [arrays(view) for view in one.views]) for one in seen)]


def viewed(*paths: Path, board: Board | None = None) -> tuple[Board, list[CameraViews]]:
    return board_views(board or BOARD, board_films(paths)[0])


@pytest.mark.nightly
def test_the_views_are_those_of_the_videos_also_where_both_are_mixed(films, corners, tmp_path):
    of_videos = viewed(films)
    assert board_films([corners])[1] == ["sync.toml: cam01 +0.000 s, cam02 -0.123 s"]
    assert of_videos[0] == OLD
    assert [len(one.views) > 3 for one in of_videos[1]] == [True, True]
    assert exact(*viewed(corners)) == exact(*of_videos)
    shutil.copytree(corners, tmp_path, dirs_exist_ok=True)
    (tmp_path / "corners" / "cam02.corners").unlink()
    (tmp_path / "videos").mkdir()
    shutil.copy(films / "videos" / "cam02.mp4", tmp_path / "videos")
    assert [film.path.name for film in board_films([tmp_path])[0]] == ["cam01.corners", "cam02.mp4"]  # as videos are
    assert exact(*viewed(tmp_path)) == exact(*of_videos)


@pytest.mark.nightly
def test_a_video_beside_its_corners_is_searched_and_a_note_names_them(films, corners, tmp_path):
    shutil.copytree(films, tmp_path, dirs_exist_ok=True)
    shutil.copytree(corners / "corners", tmp_path / "corners")
    found, notes = board_films([tmp_path])
    assert [film.path.suffix for film in found] == [".mp4", ".mp4"]
    assert f"{tmp_path / 'corners' / 'cam01.corners'}: not used: the images of cam01 are here" in notes
    with pytest.raises(UserError, match=r"cam01.corners: .*cam01.mp4 exists too: allowed: one"):
        board_films([tmp_path / "videos" / "cam01.mp4", tmp_path / "corners" / "cam01.corners"])
    with pytest.raises(UserError, match=r"corners and no images: allowed: a folder with videos"):
        searchable_films([tmp_path / "corners" / "cam01.corners"])


@pytest.mark.nightly
def test_pictures_of_a_board_at_rest_are_numbered_over_all_cameras(tmp_path):
    shown = pictures(BOARD)[:3]
    picture_folder(tmp_path / "left", shown, ["a.png", "b.png", "d.png"])
    picture_folder(tmp_path / "right", [np.full((240, 320), 150, np.uint8), *shown[:2]], ["b.png", "c.png", "d.png"])
    of_pictures = viewed(tmp_path)
    assert [[view.time_s for view in one.views] for one in of_pictures[1]] == [[0.0, 1.0, 3.0], [2.0, 3.0]]
    there = tmp_path / "there" / "left.corners"
    write_corners(there, detected(BOARD, tmp_path / "left", "left"))
    assert exact(*viewed(there, tmp_path / "right")) == exact(*of_pictures)


@pytest.mark.slow
def test_a_board_that_the_probed_images_do_not_show_is_searched_in_all_variants(tmp_path, monkeypatch):
    monkeypatch.setattr("zenocap.tools.setup.calibration.film_search.PROBED_FRAMES", 1)
    picture_folder(tmp_path / "left", [np.full((240, 320), 150, np.uint8), *pictures(OLD)[:2]], ["a.png", "b.png", "c.png"])
    found = detected(BOARD, tmp_path / "left", "left")
    assert sum(found.counts) == 0
    seen = found.searched(OLD)
    assert seen is not None
    assert len(seen.views[0]) == 2


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("other", "words"),
    [
        (checked_board("charuco", 5, 6, 36.0), "board.square_m = 0.035: allowed: 0.036, as in the options"),
        (checked_board("charuco", 6, 6, 35.0), "board.columns = 5: allowed: 6, as in the options"),
        (checked_board("aprilgrid", 5, 6, 35.0), "board.kind = charuco: allowed: aprilgrid, as in the options"),
        (checked_board("charuco", 5, 6, 35.0, 20.0), "board.marker_m = 0.02625: allowed: 0.02, as in the options"),
    ],
)
def test_the_corners_of_another_board_are_refused(corners, other, words):
    with pytest.raises(UserError, match=f"cam01.corners: {words}"):
        viewed(corners, board=other)


@pytest.mark.nightly
def test_a_board_that_other_cameras_see_with_exchanged_colours_is_refused(corners, tmp_path):
    shutil.copy(corners / "corners" / "cam01.corners", tmp_path)
    exchanged = [255 - one for one in pictures(BOARD, z=0.4)]
    film = board_video(tmp_path / "v" / "cam02.mp4", exchanged, FPS)
    write_corners(tmp_path / "cam02.corners", detected(BOARD, film, "cam02"))
    with pytest.raises(UserError, match=r"cam01.corners: the board is seen with another pattern or with exchanged colours"):
        viewed(tmp_path)


def test_a_film_without_the_board_is_named_with_the_reason(tmp_path):
    path = picture_folder(tmp_path / "left", [np.full((240, 320), 5, np.uint8)], ["a.png"])
    with pytest.raises(UserError, match=r"left: the board is not found: the images are too dark"):
        detected(BOARD, path, "left")


@pytest.fixture(scope="module")
def content(corners) -> dict:
    path = corners / "corners" / "cam02.corners"
    return msgspec.msgpack.decode(FORMAT.body_of(path, path.read_bytes()))


def changed(content: dict, key: str, value: object) -> bytes:
    """A whole file with another value."""
    one = deepcopy(content)
    *parents, last = (int(part) if part.isdecimal() else part for part in key.split("."))
    place = reduce(getitem, parents, one)
    place[last] = value(place[last]) if callable(value) else value
    return FORMAT.with_header(msgspec.msgpack.encode(one))


def put(kind: str, place, value):
    """Change values of an array in its bytes."""

    def apply(data: bytes) -> bytes:
        values = np.frombuffer(data, dtype=kind).copy()
        values[place] = value
        return values.tobytes()

    return apply


WRONG = [
    ("camera", "../x", r"camera = '../x': allowed: a name without '/'"),
    ("camera", "a\x1b[2J", r"camera = 'a\\x1b\[2J': allowed"),
    ("camera", "", r"at `\$.camera`"),
    ("camera", 7, r"Expected `str`, got `int` - at `\$.camera`"),
    ("source", ".hidden", r"source = '.hidden': allowed"),
    ("board.kind", "circles", r"Invalid enum value 'circles' - at `\$.board.kind`"),
    ("board.columns", 41, r"board.columns = 41: allowed: 2 to 40"),
    ("board.rows", -1, r"board.rows = -1: allowed: 2 to 40"),
    ("board.columns", 7, r"views\[0\].ids|pixels = .*allowed: corners of a board"),
    ("board.square_m", float("nan"), r"board.square_m = nan: allowed: 0.002 to 1"),
    ("board.marker_m", float("inf"), r"board.marker_m = inf: allowed: 0 to 1"),
    ("board.dictionary", "9x9", r"board.dictionary = '9x9': allowed: 4x4_50"),
    ("size", [320, 16385], r"size.1 = 16385: allowed: 16 to 16384"),
    ("size", [320], r"Expected `array` of length 2"),
    ("period_s", 0.0, r"period_s = 0.0: allowed: 0.001 to 10000"),
    ("period_s", "x", r"at `\$.period_s`"),
    ("looks", 0, r"looks = 0: allowed: 1 to"),
    ("looks", 3, r"variants\[1\].views.times = 64 bytes: allowed: 24 bytes"),
    ("names", ["a"] * 8, r"period_s = 0.\d+: allowed: 1, of pictures"),
    ("variants", [], r"at `\$.variants`"),
    ("variants.0.inverted", True, r"variants = .*allowed: "),
    ("variants.1.views", None, r"variants = no views: allowed"),
    ("variants.1.views.times", b"", r"times = 0 bytes: allowed: 8 bytes"),
    ("variants.1.views.times", put("<f8", 3, np.nan), r"times = .*allowed: increasing numbers from 0 to"),
    ("variants.1.views.times", put("<f8", 3, 9.0), r"times = .*allowed: increasing numbers from 0 to"),
    ("variants.1.views.times", put("<f8", -1, 1e6), r"times = 0.0 to 1000000.0: allowed: increasing"),
    ("variants.1.views.counts", put("<u2", 0, 5), r"counts = 5 to \d+: allowed: 6 to 20"),
    ("variants.1.views.counts", put("<u2", 0, 65535), r"counts = \d+ to 65535: allowed: 6 to 20"),
    ("variants.1.views.ids", put("<u2", 0, 19), r"views\[0\].ids = .*allowed: increasing numbers below 20"),
    ("variants.1.views.ids", lambda data: data[:-2], r"ids = \d+ bytes: allowed: \d+ bytes"),
    ("variants.1.views.pixels", put("<f8", 0, np.inf), r"pixels = \[inf, .*allowed: in the image of 320 x 240 px"),
    ("variants.1.views.pixels", put("<f8", 1, -9.0), r"pixels = .*-9.0\]: allowed: in the image of 320 x 240 px"),
    ("variants.1.views.pixels", put("<f8", slice(None), 100.0), r"allowed: corners of a board that is seen from the"),
    ("variants.1.views.pixels", lambda data: data + data, r"pixels = \d+ bytes: allowed: \d+ bytes"),
    ("more", 1, r"Object contains unknown field `more`"),
]


@pytest.mark.nightly
@pytest.mark.parametrize(("key", "value", "words"), WRONG, ids=[f"{k}-{key}" for k, (key, _, _) in enumerate(WRONG)])
def test_a_wrong_value_is_named(content, tmp_path, key, value, words):
    path = tmp_path / "wrong.corners"
    path.write_bytes(changed(content, key, value))
    with pytest.raises(UserError, match=words) as error:
        read_corners(path)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


def test_damaged_and_missing_files_are_refused(corners, tmp_path):
    whole = (corners / "corners" / "cam02.corners").read_bytes()
    path = tmp_path / "damaged.corners"
    path.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    with pytest.raises(UserError, match=r"damaged\.corners: damaged: checksum = "):
        read_corners(path)
    with pytest.raises(UserError, match=r"none.corners: cannot be read: No such file"):
        read_corners(tmp_path / "none.corners")


@pytest.mark.slow
def test_any_changed_byte_is_refused_or_gives_valid_views(content, tmp_path):
    """Also behind a right checksum."""
    body, rng, refused = msgspec.msgpack.encode(content), np.random.default_rng(0), 0
    for _ in range(300):
        damaged = bytearray(body)
        for place in rng.integers(len(body), size=rng.integers(1, 4)):
            damaged[place] = rng.integers(256)
        try:
            found = parsed(tmp_path / "a.corners", FORMAT.with_header(bytes(damaged)))
        except UserError:
            refused += 1
        else:
            assert all(np.isfinite(view.pixels).all() for views in found.views.values() for view in views)
    assert refused > 30


def test_what_was_read_is_written_again_with_equal_bytes(corners):
    data, path = (corners / "corners" / "cam02.corners").read_bytes(), Path("x.corners")
    assert packed(path, parsed(path, data)) == data
