"""Video files of any container, codec, pixel format and frame times, with or without sound."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from av.audio.stream import AudioStream
from av.container import OutputContainer
from av.video.stream import VideoStream

from zenocap.common.arrays import Floats, Image

CLOCK = 90_000  # ticks a second of given frame times
OPTIONS = {  # x265 without a pool of threads: with it, the end of one file never came, at full load of a core
    "libx264": {"crf": "10", "preset": "ultrafast"},
    "libx265": {"crf": "10", "preset": "ultrafast", "x265-params": "log-level=none:pools=none"},
    "libvpx-vp9": {"crf": "15", "b": "0", "deadline": "realtime", "cpu-used": "8"},
}
SOUND_BLOCK = 1024  # samples of a frame of sound


@dataclass(frozen=True)
class Sound:
    """samples: (n,) from -1 to 1, mono.  rate: samples/s.  start_s: of the first one, in the time of the pictures."""

    samples: Floats
    rate: int = 16_000
    start_s: float = 0.0


def write_video(
    path: Path, images: Iterable[Image], times_s: Sequence[float] | None = None, *, fps: int = 30,
    codec: str = "libx264", pixels: str = "yuv420p", sound: Sound | None = None,
    options: Mapping[str, str] | None = None, pixel_shape: Fraction | None = None, clock: int = CLOCK,
) -> Path:  # fmt: skip
    """Write images (height, width, 3), blue, green, red, of one size; at increasing times, else at a constant rate.

    options: more of the codec.  pixel_shape: width to height of a pixel.  clock: ticks a second of the given times.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with av.open(str(path), "w") as container:
        stream: VideoStream | None = None
        heard = None if sound is None else container.add_stream("aac", rate=sound.rate, layout="mono")
        for k, image in enumerate(images):
            if stream is None:
                added = container.add_stream(codec, rate=fps, options=OPTIONS.get(codec, {}) | dict(options or {}))
                assert isinstance(added, VideoStream)
                stream = added
                stream.width, stream.height, stream.pix_fmt = image.shape[1], image.shape[0], pixels
                if pixel_shape is not None:
                    stream.codec_context.sample_aspect_ratio = pixel_shape
                if times_s is not None:
                    stream.codec_context.time_base = Fraction(1, clock)
            frame = av.VideoFrame.from_ndarray(image, format="bgr24")
            frame.pts, frame.time_base = k, Fraction(1, fps)
            if times_s is not None:
                frame.pts, frame.time_base = round(times_s[k] * clock), Fraction(1, clock)
            container.mux(stream.encode(frame))
        if stream is not None:
            container.mux(stream.encode(None))
        if sound is not None:
            assert isinstance(heard, AudioStream)
            _write_sound(container, heard, sound)
    return path


def ask_for_turn(path: Path, degrees: int) -> None:
    """Write the matrix of a turn into the track header of an MP4 file, as phones do."""
    content = bytearray(path.read_bytes())
    c, s = {0: (1, 0), 90: (0, 1), 180: (-1, 0), 270: (0, -1)}[degrees]
    at = content.index(b"tkhd") + 4 + 4 + 20 + 16  # version, times and ids; layer, volume
    content[at : at + 32] = b"".join((v * 65536).to_bytes(4, "big", signed=True) for v in (c, s, 0, -s, c, 0, 0, 0))
    path.write_bytes(content)


def copied(
    source: Path, target: Path, first: int = 0, shift_s: float = 0.0, end: int | None = None,
    tags: Mapping[str, str] | None = None,
) -> Path:  # fmt: skip
    """The video's packets from `first` on without new encoding, with times that are `shift_s` later; all of its sound.

    tags: metadata of the file.
    """
    options = {"avoid_negative_ts": "0"} | ({"movflags": "use_metadata_tags"} if tags else {})
    with av.open(str(source)) as container, av.open(str(target), "w", options=options) as copy:
        copy.metadata.update(tags or {})
        added = {
            one.index: copy.add_stream_from_template(one)
            for one in (*container.streams.video[:1], *container.streams.audio[:1])
        }
        packets = [one for one in container.demux() if one.size and one.stream.index in added]
        of_video = [one for one in packets if one.stream.type == "video"][first:end]
        for packet in packets:
            if packet.stream.type == "video" and packet not in of_video:
                continue
            assert packet.time_base is not None
            assert packet.pts is not None
            assert packet.dts is not None
            shift = round(shift_s / packet.time_base)
            packet.pts, packet.dts = packet.pts + shift, packet.dts + shift
            packet.stream = added[packet.stream.index]
            copy.mux(packet)
    return target


def _write_sound(container: OutputContainer, stream: AudioStream, sound: Sound) -> None:
    samples = sound.samples.astype(np.float32)
    for first in range(0, len(samples), SOUND_BLOCK):
        frame = av.AudioFrame.from_ndarray(samples[None, first : first + SOUND_BLOCK], format="fltp", layout="mono")
        frame.sample_rate, frame.time_base = sound.rate, Fraction(1, sound.rate)
        frame.pts = first + round(sound.start_s * sound.rate)
        container.mux(stream.encode(frame))
    container.mux(stream.encode(None))
