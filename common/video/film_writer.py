"""Films for people to look at: evenly spaced pictures, in codecs that browsers and programs play."""

from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Literal

import av
from av.codec.codec import UnknownCodecError
from av.error import FFmpegError
from av.video.reformatter import ColorRange, Colorspace
from av.video.stream import VideoStream

from zenocap.common.arrays import Image
from zenocap.common.errors import UserError
from zenocap.common.video.parameters import ENCODERS, MAX_WEBP_SIDE_PX

Codec = Literal["h264", "vp9", "mpeg4", "webp"]

CODECS: Mapping[str, tuple[Codec, ...]] = {  # by suffix, the default first
    ".mp4": ("h264", "vp9", "mpeg4"),
    ".webm": ("vp9",),
    ".webp": ("webp",),  # an animated picture, which pages show like any other
}
CONTAINERS: Mapping[str, tuple[str, dict[str, str]]] = {  # format; options: index before the film, endless repetition
    ".mp4": ("mp4", {"movflags": "+faststart"}),
    ".webm": ("webm", {}),
    ".webp": ("webp", {"loop": "0"}),
}
BT709 = 1  # FFmpeg's number of the primaries, the transfer function and the matrix of ITU-R BT.709


def codec_of(path: Path, codec: Codec | None) -> Codec:
    """Return the codec of a film, that of its suffix for None.  Raises UserError when they do not belong together."""
    suffix = path.suffix.lower()
    if suffix not in CODECS:
        raise UserError(f"{path}: not the name of a film: allowed: {', '.join(CODECS)}")
    if codec is not None and codec not in CODECS[suffix]:
        raise UserError(f"--codec {codec}: allowed in {suffix}: {', '.join(CODECS[suffix])}")
    return codec or CODECS[suffix][0]


class FilmWriter:
    """Writes pictures at a constant rate; colours are those of ITU-R BT.709, as the file declares.

    Equal pictures give equal bytes: the number of threads of the encoder is fixed.
    """

    def __init__(self, path: Path, size: tuple[int, int], fps: float, codec: Codec | None = None) -> None:
        """size: (width, height), px, both even.  Raises OSError, and UserError for a codec that does not fit."""
        chosen = codec_of(path, codec)
        encoder, pixels, options = ENCODERS[chosen]
        if chosen == "webp" and max(size) > MAX_WEBP_SIDE_PX:
            raise UserError(f"{path}: {size[0]}x{size[1]}: allowed in .webp: sides up to {MAX_WEBP_SIDE_PX}")
        name, container_options = CONTAINERS[path.suffix.lower()]
        try:
            self._container = av.open(str(path), "w", format=name, container_options=container_options)
            stream = self._container.add_stream(encoder, rate=Fraction(fps).limit_denominator(1000), options=dict(options))
            assert isinstance(stream, VideoStream)
            context = stream.codec_context
            context.width, context.height = size
            context.pix_fmt, context.thread_count = pixels, 2
            if chosen != "webp":
                context.color_primaries = context.color_trc = context.colorspace = BT709
                context.color_range = ColorRange.MPEG
            self._container.start_encoding()
        except UnknownCodecError as error:
            others = ", ".join(other for other in CODECS[path.suffix.lower()] if other != chosen)
            missing = f"the installed PyAV has no {encoder}"
            raise UserError(f"--codec {chosen}: {missing}: allowed: {others or 'another suffix'}") from error
        except (OSError, FFmpegError) as error:
            raise OSError(error.errno, error.strerror or str(error)) from error
        self._stream, self._pixels, self._webp = stream, pixels, chosen == "webp"

    def write(self, image: Image) -> None:
        """Append a picture (h, w, 3), blue, green, red.  Raises OSError when the disk is full."""
        frame = av.VideoFrame.from_ndarray(image, format="bgr24")
        if not self._webp:
            frame = frame.reformat(format=self._pixels, dst_colorspace=Colorspace.ITU709, dst_color_range=ColorRange.MPEG)
        self._container.mux(self._stream.encode(frame))

    def close(self) -> None:
        """End the file.  Raises OSError when the disk is full."""
        try:
            self._container.mux(self._stream.encode())
        finally:
            self._container.close()
