"""Videos and folders of images of a board: their layouts, offsets, sizes, and what is wrong with them."""

import cv2
import numpy as np
import pytest

from tests.support.board_pictures import before, board_video, picture_folder, picture_of, plain_camera, true_pixels
from zenocap.common.errors import UserError
from zenocap.tools.setup.calibration.board import checked_board
from zenocap.tools.setup.calibration.board_films import BoardFilm, board_films, board_views, check_floor

BOARD = checked_board("charuco", 5, 7, 35.0)
CAMERA = plain_camera((320, 240), 300.0)
FPS, FRAMES = 10, 8


def poses(count: int = FRAMES):
    """The board moves to the right and turns a little."""
    return [before(BOARD, 0.5, (0.2, 0.1, 0.02 * k), (0.006 * (k - count / 2), 0.0)) for k in range(count)]


@pytest.fixture(scope="module")
def pictures():
    return [picture_of(BOARD, CAMERA, pose, seed) for seed, pose in enumerate(poses())]


@pytest.fixture(scope="module")
def one_video(tmp_path_factory, pictures) -> bytes:
    return board_video(tmp_path_factory.mktemp("video") / "one.mp4", pictures, FPS).read_bytes()


@pytest.fixture
def folder(tmp_path, one_video):
    """Two cameras in videos/."""
    (tmp_path / "videos").mkdir()
    for name in ("cam01", "cam02"):
        (tmp_path / "videos" / f"{name}.mp4").write_bytes(one_video)
    return tmp_path


@pytest.mark.slow
def test_videos_are_found_in_both_layouts_and_as_files_and_others_beside_them_are_not_cameras(folder):
    files = sorted((folder / "videos").iterdir())
    for name in ("._cam01.mp4", "notes.txt", ".DS_Store"):
        (folder / "videos" / name).write_bytes(b"\0")
    found = [board_films(paths) for paths in ([folder], [folder / "videos"], files)]
    assert [[film.path for film in films] for films, _ in found] == [files] * 3
    assert [[film.name for film in films] for films, _ in found] == [["cam01", "cam02"]] * 3
    assert not any(film.still for film in found[0][0])
    assert found[0][1] == []


@pytest.mark.nightly
def test_the_times_of_views_are_those_of_the_frames(folder, pictures):
    seen_board, seen = board_views(BOARD, board_films([folder])[0])
    assert seen_board == BOARD
    for camera in seen:
        assert camera.size == (320, 240)
        assert camera.looks == len(camera.views) == FRAMES
        assert camera.period_s == pytest.approx(1 / FPS)
        assert not camera.still
        assert [view.time_s for view in camera.views] == pytest.approx([k / FPS for k in range(FRAMES)])
        for view, pose in zip(camera.views, poses(), strict=True):
            assert view.pixels == pytest.approx(true_pixels(BOARD, CAMERA, pose)[view.ids], abs=1.0)  # after compression
    early, late = (true_pixels(BOARD, CAMERA, poses()[k]) for k in (3, 5))
    moved = ((late - early) * FPS / 2)[seen[0].views[4].ids]
    assert np.abs(moved).max() > 40.0  # px/s; else any velocity would do
    assert seen[0].views[4].velocities == pytest.approx(moved, abs=15.0)
    assert seen[0].views[4].velocities.mean(axis=0) == pytest.approx(moved.mean(axis=0), abs=3.0)


@pytest.mark.nightly
def test_offsets_of_sync_toml_shift_the_times(folder):
    (folder / "sync.toml").write_text("[offset_s]\ncam02 = -1.25\n")
    films, notes = board_films([folder])
    assert [film.offset_s for film in films] == [0.0, -1.25]
    assert notes == ["sync.toml: cam02 -1.250 s"]
    _, seen = board_views(BOARD, films)
    assert [camera.views[0].time_s for camera in seen] == pytest.approx([0.0, -1.25])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[offset_s]\ncam09 = 1.0\n", "sync.toml: offset_s.cam09: no such camera: allowed: cam01, cam02"),
        ("[offset_s]\ncam02 = 'late'\n", "sync.toml: offset_s.cam02 = 'late': allowed: seconds"),
        ("cam02 = 1.0\n", "sync.toml: allowed: one table"),
    ],
)
def test_a_wrong_sync_toml_is_named(folder, text, message):
    (folder / "sync.toml").write_text(text)
    with pytest.raises(UserError) as error:
        board_films([folder])
    assert message in str(error.value)


@pytest.mark.slow
def test_folders_of_images_are_cameras_and_equal_names_are_one_moment(tmp_path, pictures):
    picture_folder(tmp_path / "left", pictures[:3], ["a.png", "b.jpg", "d.bmp"])
    picture_folder(tmp_path / "right", pictures[:3], ["b.png", "c.PNG", "d.png"])
    (tmp_path / "empty").mkdir()
    films, _ = board_films([tmp_path])
    assert [film.name for film in films] == ["left", "right"]
    assert all(film.still for film in films)
    _, (left, right) = board_views(BOARD, films)
    assert [view.time_s for view in left.views] == [0.0, 1.0, 3.0]
    assert [view.time_s for view in right.views] == [1.0, 2.0, 3.0]
    assert left.still
    assert left.period_s == 1.0
    assert all((view.velocities == 0).all() for view in left.views)


@pytest.mark.slow
def test_probes_of_stills_are_spread_over_all_images(tmp_path, pictures):
    """Only the last images show the board, whose colours are exchanged."""
    wall = [np.full((240, 320), 150, np.uint8)] * 40
    picture_folder(tmp_path / "left", [*wall, *(255 - one for one in pictures)])
    found, seen = board_views(BOARD, board_films([tmp_path])[0])
    assert found.inverted
    assert len(seen[0].views) == len(pictures)


@pytest.mark.slow
def test_the_camera_that_sees_most_tells_the_variant_of_the_board(tmp_path):
    board = checked_board("charuco", 5, 6, 35.0)
    old = next(one for one in board.variants() if one.legacy and not one.inverted)
    shown = [picture_of(old, CAMERA, before(old, 0.5, (0.2, 0.1 * k, 0.0))) for k in range(3)]
    far = [picture_of(old, CAMERA, before(old, 0.7, (0.2, 0.1 * k, 0.0), (0.3, 0.0))) for k in range(3)]
    picture_folder(tmp_path / "a", [*far, shown[0]])
    picture_folder(tmp_path / "b", shown)
    found, seen = board_views(board, board_films([tmp_path])[0])
    assert found == old
    assert len(seen[1].views) == 3


@pytest.mark.slow
def test_a_long_video_is_searched_in_stretches(folder, monkeypatch):
    monkeypatch.setattr("zenocap.tools.setup.calibration.film_search.MAX_LOOKS", 4)
    monkeypatch.setattr("zenocap.tools.setup.calibration.film_search.BURST_S", 0.2)
    _, seen = board_views(BOARD, board_films([folder])[0])
    assert seen[0].looks == 4
    assert [round(FPS * view.time_s) for view in seen[0].views] == [0, 1, 4, 5]  # neighbours, for velocities
    assert not np.isnan(seen[0].views[1].velocities).any()


@pytest.mark.nightly
def test_a_cut_video_counts_as_far_as_it_goes(folder, pictures):
    path = folder / "videos" / "cam02.mkv"
    (folder / "videos" / "cam02.mp4").unlink()
    whole = board_video(path, pictures, FPS).read_bytes()
    path.write_bytes(whole[: int(0.7 * len(whole))])
    _, seen = board_views(BOARD, board_films([folder])[0])
    assert 2 <= len(seen[1].views) < FRAMES


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda at: at.mkdir(), "no videos and no folders of images in it: allowed: a folder with videos"),
        (lambda at: None, "no such file or folder: allowed: a folder with videos"),
        (lambda at: (at / "cam01").mkdir(parents=True), "no videos and no folders of images in it"),
        (lambda at: (at.mkdir(), (at / "a.png").write_bytes(b"x")), "no videos and no folders of images in it"),
    ],
)
def test_a_folder_without_films_is_an_error(tmp_path, make, message):
    make(tmp_path / "rig")
    with pytest.raises(UserError) as error:
        board_films([tmp_path / "rig"])
    assert message in str(error.value)
    assert str(tmp_path / "rig") in str(error.value)


def test_mixed_and_doubled_cameras_are_errors(folder, pictures):
    one = folder / "videos" / "cam01.mp4"
    still = picture_folder(folder / "stills" / "cam03", pictures[:1])
    other = one.with_suffix(".mov")
    other.write_bytes(b"")
    for second, message in (
        (still, "cam01.mp4: videos and folders of images together: allowed: one kind"),
        (other, "cam01.mov: .*cam01.mp4 exists too: allowed: one video per camera"),
        (folder / "none.mp4", "none.mp4: no such file"),
    ):
        with pytest.raises(UserError, match=message):
            board_films([one, second])


def test_an_image_that_cannot_be_read_or_has_another_size_is_named(tmp_path, pictures):
    picture_folder(tmp_path / "a", pictures[:3])
    other_size = cv2.imencode(".png", pictures[1][:200])[1].tobytes()
    for content, message in (
        (b"no image", "not a picture that can be decoded: allowed: PNG, JPEG or BMP of at most 67108864 pixels"),
        (other_size, "the size of the images changes from 320 x 240 to 320 x 200 px: allowed: one size"),
    ):
        (tmp_path / "a" / "001.png").write_bytes(content)
        with pytest.raises(UserError, match=f"001.png: {message}"):
            board_views(BOARD, board_films([tmp_path])[0])
    (tmp_path / "b").mkdir()
    with pytest.raises(UserError, match=r"b: no images in it: allowed: a folder with videos"):
        board_views(BOARD, board_films([tmp_path / "a", tmp_path / "b"])[0])


@pytest.mark.slow
def test_a_file_that_is_no_video_and_a_camera_without_the_board_are_named(folder):
    (folder / "videos" / "cam02.mp4").write_bytes(b"no video")
    with pytest.raises(UserError, match=r"cam02.mp4"):
        board_views(BOARD, board_films([folder])[0])
    wall = np.random.default_rng(0).normal(120, 5, (240, 320)).astype(np.uint8)
    board_video(folder / "videos" / "cam02.mp4", [wall] * 2, FPS)
    with pytest.raises(UserError, match=r"cam02.mp4: the board is not found: no markers are seen"):
        board_views(BOARD, board_films([folder])[0])
    board_video(folder / "videos" / "cam01.mp4", [wall] * 2, FPS)
    calls = []
    with pytest.raises(UserError, match=r"cam01.mp4: the board is not found: no markers are seen"):
        board_views(BOARD, board_films([folder])[0], lambda *call: calls.append(call))
    assert calls == [(0, 0, "cam01"), (0, 0, "cam02")]  # a few images of each, before all are searched


def test_a_time_on_the_floor_outside_of_all_videos_is_named_before_the_search(folder):
    (folder / "sync.toml").write_text("[offset_s]\ncam02 = 3.0\n")
    films, end_s = board_films([folder])[0], 3.0 + FRAMES / FPS
    check_floor(films, [0.0, end_s])
    with pytest.raises(UserError, match=rf"--floor 99: allowed: 0\.0 to {end_s:.1f}, seconds of the videos"):
        check_floor(films, [1.0, 99.0])


@pytest.mark.nightly
def test_progress_names_the_camera_and_counts(folder):
    calls = []
    board_views(BOARD, board_films([folder])[0], lambda *call: calls.append(call))
    assert (0, 0, "cam02") in calls
    assert (FRAMES, FRAMES, "cam01") in calls
    assert BoardFilm("a", folder / "videos" / "cam01.mp4").offset_s == 0.0
