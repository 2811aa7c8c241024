"""Try network streams: what they send, how long the first image takes, or why none comes."""

import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from urllib.parse import urlsplit

import av
import numpy as np
from av.container import InputContainer
from av.error import FFmpegError

from zenocap.common.arrays import Image
from zenocap.common.errors import UserError
from zenocap.common.rig.source_kinds import STREAMS
from zenocap.common.rig.sources import without_password

TIMEOUT_S = 5.0  # to open a stream, and for each image; as a viewer has it; chosen by hand
NO_IMAGE_S = 15.0  # of packets that give no image; cameras have key frames up to 10 s apart; chosen by hand
MEASURED_S = 2.0  # time over which the rate is measured; chosen by hand
WAITING_S = 0.5  # after the first image, in which those come that FFmpeg kept while it examined the stream; by hand
AT_ONCE = 16  # streams
REASONS = (  # part of FFmpeg's text, and what it means to a user
    ("refused", "nothing answers at this port: is the camera on, and are address and port right?"),
    ("401", "user name or password is wrong or missing: rtsp://USER:PASSWORD@HOST/..."),
    ("403", "this user may not see this stream"),
    ("404", "the camera has no stream of this name: its manual or its web page names the path"),
    ("resolve", "no host of this name"),
    ("Name or service", "no host of this name"),
    ("unreachable", "no network leads to this address"),
    ("route", "no network leads to this address"),
    ("timed out", "no answer in time: is the camera on, and in this network?"),
    ("Immediate exit", "no answer in time: is the camera on, and in this network?"),
    ("Input/output", "no host of this name, or the connection broke"),
    ("Invalid data", "what it sends is no video"),
)


@dataclass(frozen=True)
class TriedStream:
    """A stream that was tried.  address: without password.

    size: (width, height), px; None when no image came.  rate: frames/s, measured; declared_rate: of the stream, 0
    for not at all.  first_s: from the start of the connection to the first image, seconds.  problem: why there is no
    image; empty otherwise.
    """

    address: str
    size: tuple[int, int] | None = None
    codec: str = ""
    rate: float = 0.0
    declared_rate: float = 0.0
    first_s: float = 0.0
    image: Image | None = None
    problem: str = ""


def _frames(container: InputContainer, stream: av.VideoStream, begin_s: float) -> Iterator[tuple[float, av.VideoFrame]]:
    """Frames with their time since `begin_s`; ends where NO_IMAGE_S bring packets and no frame."""
    last_s = time.monotonic()
    for packet in container.demux(stream):
        for frame in packet.decode():
            last_s = time.monotonic()
            yield last_s - begin_s, frame
        if time.monotonic() - last_s > NO_IMAGE_S:
            return


def check_address(url: str) -> None:
    """Raise UserError for an address that is none of a stream."""
    try:
        parts = urlsplit(url)
        good = parts.scheme in STREAMS and bool(parts.hostname) and (parts.port is None or parts.port > 0)
    except ValueError:
        good = False
    if not good:
        allowed = ", ".join(f"{scheme}://HOST[:PORT]/..." for scheme in STREAMS)
        raise UserError(f"{without_password(url)}: allowed: {allowed}")


def tried_streams(urls: Sequence[str], seconds: float = MEASURED_S) -> list[TriedStream]:
    """Try all streams beside each other.  seconds: for measuring the rate.  Raises UserError for a wrong address."""
    for url in urls:
        check_address(url)
    with ThreadPoolExecutor(min(AT_ONCE, max(1, len(urls)))) as pool:
        return list(pool.map(lambda url: tried_stream(url, seconds), urls))


def tried_stream(url: str, seconds: float = MEASURED_S) -> TriedStream:
    """Connect, wait for the first image, and measure the rate."""
    address, begin_s = without_password(url), time.monotonic()
    try:
        with _opened(url) as container:
            if not container.streams.video:
                return TriedStream(address, problem="has sound, but no video")
            stream = container.streams.video[0]
            first: av.VideoFrame | None = None
            first_s, arrivals = 0.0, list[float]()
            for arrival_s, frame in _frames(container, stream, begin_s):
                if first is None:
                    first, first_s = frame, arrival_s
                if arrival_s - first_s >= WAITING_S:
                    arrivals.append(arrival_s)
                if arrival_s - first_s >= WAITING_S + seconds:
                    break
            if first is None:
                return TriedStream(address, problem="is open, but sends no image that can be decoded")
            return TriedStream(
                address=address,
                size=(first.width, first.height),
                codec=stream.codec_context.name,
                rate=(len(arrivals) - 1) / (arrivals[-1] - arrivals[0]) if len(arrivals) > 1 else 0.0,
                declared_rate=float(stream.average_rate or 0),
                first_s=first_s,
                image=np.asarray(first.to_ndarray(format="bgr24"), dtype=np.uint8),
            )
    except (FFmpegError, OSError, ValueError) as error:
        return TriedStream(address, problem=_reason(error))


def _opened(url: str) -> InputContainer:
    options = {"rtsp_flags": "prefer_tcp"} if url.startswith("rtsp") else {}
    return av.open(url, options=options, timeout=(TIMEOUT_S, TIMEOUT_S), metadata_errors="replace")


def _reason(error: Exception) -> str:
    """FFmpeg's text without the address, which may contain a password, and what it means."""
    text = str(getattr(error, "strerror", None) or type(error).__name__)
    meant = next((meaning for part, meaning in REASONS if part.lower() in f"{text} {type(error).__name__}".lower()), "")
    return f"{text}: {meant}" if meant else text
