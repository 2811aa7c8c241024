"""Films to look at: codecs by suffix, colours, and errors before anything is drawn."""

from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image, ImageSequence

from zenocap.common.errors import UserError
from zenocap.common.video.film_writer import CODECS, FilmWriter, codec_of

SIZE = (64, 48)
COLOURS = [(40, 90, 200), (200, 120, 60), (90, 180, 70)]  # blue, green, red


def pictures() -> list[np.ndarray]:
    return [np.full((SIZE[1], SIZE[0], 3), colour, dtype=np.uint8) for colour in COLOURS]


def write(path: Path, codec: str | None = None) -> Path:
    film = FilmWriter(path, SIZE, 25.0, codec)  # type: ignore[arg-type]
    for picture in pictures():
        film.write(picture)
    film.close()
    return path


def assert_colours(found: list[np.ndarray]) -> None:
    for picture, expected in zip(found, pictures(), strict=True):
        assert np.abs(picture.astype(int) - expected).mean() < 4


@pytest.mark.parametrize(("suffix", "codec"), [(s, c) for s, codecs in CODECS.items() for c in codecs if c != "webp"])
def test_pictures_come_back_with_their_colours(suffix: str, codec: str, tmp_path: Path) -> None:
    with av.open(str(write(tmp_path / f"a{suffix}", codec))) as container:
        stream = container.streams.video[0]
        assert stream.average_rate == 25
        assert (stream.codec_context.colorspace, stream.codec_context.color_range) == (1, 1)  # BT.709, 16 to 235
        found = [frame.reformat(format="bgr24", src_colorspace="ITU709").to_ndarray() for frame in container.decode(stream)]
    assert_colours(found)


def test_an_animated_picture_repeats_for_ever(tmp_path: Path) -> None:
    with Image.open(write(tmp_path / "a.webp")) as animation:
        assert (animation.n_frames, animation.info["loop"]) == (3, 0)
        assert_colours([np.asarray(frame.convert("RGB"))[..., ::-1] for frame in ImageSequence.Iterator(animation)])


def test_equal_pictures_give_equal_bytes(tmp_path: Path) -> None:
    assert write(tmp_path / "a.mp4").read_bytes() == write(tmp_path / "b.mp4").read_bytes()


def test_a_codec_that_does_not_belong_to_the_suffix_is_refused() -> None:
    with pytest.raises(UserError, match=r"--codec h264: allowed in \.webm: vp9"):
        codec_of(Path("a.webm"), "h264")
    with pytest.raises(UserError, match=r"a\.avi: not the name of a film: allowed: \.mp4, \.webm, \.webp"):
        codec_of(Path("a.avi"), None)


def test_a_file_that_cannot_be_written_is_an_error_at_once(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="No such file or directory"):
        FilmWriter(tmp_path / "missing" / "a.mp4", SIZE, 25.0)
    with pytest.raises(UserError, match=r"allowed in \.webp: sides up to 16383"):
        FilmWriter(tmp_path / "a.webp", (16400, 48), 25.0)
