"""Saved background model: round trip, taken up where it fits, refused elsewhere."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.common.vision.test_adaptive import HEIGHT, LEARNT, ROOM, WIDTH, overlap, person, picture
from tests.common.vision.test_background import shot
from zenocap.common.arrays import Image
from zenocap.common.errors import UserError
from zenocap.common.vision.adaptive.follow import follow
from zenocap.common.vision.adaptive.model import Adaptive, start
from zenocap.common.vision.adaptive.saved import Owner, packed, read, shift_px, taken_up, write
from zenocap.common.vision.foreground import ForegroundOptions
from zenocap.common.vision.silhouette import SilhouetteOptions

SIZE = (WIDTH, HEIGHT)
OPTIONS = ForegroundOptions()
OWNER = Owner("lab", "1", "4f")


@pytest.fixture(scope="module")
def model() -> Adaptive:
    return start([shot(ROOM, frame) for frame in range(LEARNT)])


@pytest.fixture
def saved(model: Adaptive, tmp_path: Path) -> Path:
    path = tmp_path / "backgrounds" / "lab-1.npz"
    write(path, packed(model, OWNER))
    return path


def moved(image: Image, px: float) -> Image:
    shift = np.array([[1, 0, px], [0, 1, px / 2]], np.float32)
    return np.asarray(cv2.warpAffine(image, shift, SIZE, borderMode=cv2.BORDER_REFLECT), dtype=np.uint8)


@pytest.mark.slow
def test_what_is_read_is_what_was_written_and_only_the_owner_may_read_it(model: Adaptive, saved: Path) -> None:
    write(saved, packed(replace(model, background=replace(model.background, halo=1.5)), OWNER))
    back = read(saved, SIZE, OWNER)
    assert np.array_equal(back.background.mean, model.background.mean)
    assert np.array_equal(back.background.weight, model.background.weight)
    assert back.background.halo == 1.5
    assert (back.noise, back.person, back.frames) == (model.noise, None, 0)
    assert saved.stat().st_mode & 0o777 == 0o600


def test_a_person_who_stands_still_from_the_first_frame_is_found_with_a_saved_model(saved: Path) -> None:
    first = picture(ROOM, person(60), 500)
    restored = taken_up(read(saved, SIZE, OWNER), first, OPTIONS)
    _, silhouette = follow(restored, first, 0.0, SilhouetteOptions(choice="nearest"))
    assert overlap(silhouette.mask, person(60)) > 0.85


def test_another_light_is_taken_into_the_model(saved: Path) -> None:
    dark = picture(ROOM * np.linspace(0.5, 0.8, WIDTH)[None, :, None], person(60), 500)
    restored = taken_up(read(saved, SIZE, OWNER), dark, OPTIONS)
    assert np.abs(restored.background.mean - dark)[:, :50].mean() < 5


@pytest.mark.parametrize("px", [1.0, 2.0, 6.0])
def test_a_camera_that_was_moved_is_refused(saved: Path, px: float) -> None:
    frame = moved(picture(ROOM, person(60), 500), px)
    assert shift_px(read(saved, SIZE, OWNER).background, frame, np.ones(3, np.float32)) == px
    assert taken_up(read(saved, SIZE, OWNER), frame, OPTIONS) is None


def test_another_room_is_refused(saved: Path) -> None:
    assert taken_up(read(saved, SIZE, OWNER), shot(ROOM[::-1, ::-1].copy(), 500), OPTIONS) is None


@pytest.mark.parametrize(
    ("owner", "message"),
    [
        (Owner("other", "1", "4f"), "of viewer '1' of rig 'lab': allowed: '1' of 'other'"),
        (Owner("lab", "2", "4f"), "of viewer '1' of rig 'lab': allowed: '2' of 'lab'"),
        (Owner("lab", "1", "50"), "viewer '1' had another source"),
    ],
)
def test_the_file_of_another_camera_is_refused(saved: Path, owner: Owner, message: str) -> None:
    with pytest.raises(UserError, match=f"{saved}: {message}"):
        read(saved, SIZE, owner)


def test_bad_files_are_refused_with_their_name(model: Adaptive, saved: Path, tmp_path: Path) -> None:
    data = saved.read_bytes()
    bad = tmp_path / "bad.npz"
    for content in (b"", data[:1000], b"no archive" * 100):
        bad.write_bytes(content)
        with pytest.raises(UserError, match=f"{bad}: .*no background model"):
            read(bad, SIZE, OWNER)
    with pytest.raises(UserError, match=rf"{saved}: mean \(120, 160, 3\) float32: allowed: \(240, 320, 3\) float32"):
        read(saved, (320, 240), OWNER)
    with pytest.raises(UserError, match=f"{tmp_path / 'none.npz'}: No such file"):
        read(tmp_path / "none.npz", SIZE, OWNER)
    fields = dict(np.load(saved))
    for content, message in (
        (fields | {"mean": fields["mean"] * np.nan}, "out of range"),
        (fields | {"version": np.int64(1)}, "version = 1: allowed: 2"),
        ({name: value for name, value in fields.items() if name != "halo"}, "no background model"),
        (fields | {"noise": np.array([object()])}, "no background model"),
    ):
        np.savez(bad, **content)
        with pytest.raises(UserError, match=message):
            read(bad, SIZE, OWNER)
