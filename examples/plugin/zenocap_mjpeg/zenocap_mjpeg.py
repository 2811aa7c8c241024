"""MJPEG over HTTP: `source = "mjpeg:http://192.168.1.20:8080/?action=stream"` in a rig file.

User and password (basic authentication) are those of ~/.netrc: neither rig file nor log has them.  The images have the
camera's times, where it sends `X-Timestamp` as mjpg-streamer does; of an http:// source they have those of receipt.
"""

import base64
import netrc
import time
from dataclasses import dataclass
from http.client import HTTPException, HTTPResponse, parse_headers
from pathlib import Path
from typing import ClassVar, Literal
from urllib.error import HTTPError
from urllib.parse import urlsplit
from urllib.request import ProxyHandler, Request, build_opener

import cv2
import numpy as np

from zenocap.common.errors import AccessDenied, OpenError
from zenocap.common.rig.source_kinds import SourceKind
from zenocap.common.rig.sources import LiveSource, SpecError

TIMEOUT_S = 5.0
MOST_BYTES = 16 << 20  # of one image


@dataclass(frozen=True)
class MjpegCamera(LiveSource):
    url: str

    kind: ClassVar[str] = "mjpeg"
    buffers: ClassVar[bool] = True

    @property
    def text(self) -> str:
        return f"mjpeg:{self.url}"

    @property
    def stamps(self) -> Literal["monotonic", "stream", "none"]:
        return "stream"


def parse(text: str, base: Path) -> MjpegCamera:
    """Raises SpecError."""
    url = text.partition(":")[2]
    parts = urlsplit(url)
    if parts.scheme not in ("http", "https") or not parts.hostname or parts.username is not None:
        raise SpecError("mjpeg:http://HOST/PATH or mjpeg:https://HOST/PATH; user and password are those of ~/.netrc")
    return MjpegCamera(url)


class MjpegCapture:
    """The parts of a multipart response, each an image."""

    def __init__(self, response: HTTPResponse) -> None:
        self._response, self._data, self._time_ms = response, b"", 0.0

    def isOpened(self) -> bool:
        return not self._response.closed

    def grab(self) -> bool:
        """Receive the next image; False at the end of the stream."""
        try:
            while not (line := self._response.readline(1000)).startswith(b"--"):
                if not line:
                    return False
            headers = parse_headers(self._response)
            size = int(headers["Content-Length"])
            self._time_ms = 1e3 * float(headers["X-Timestamp"] or time.monotonic())
            self._data = self._response.read(size) if 0 < size <= MOST_BYTES else b""
        except (OSError, HTTPException, TypeError, ValueError):
            return False
        return len(self._data) == size

    def retrieve(self) -> tuple[bool, object]:
        try:
            image = cv2.imdecode(np.frombuffer(self._data, np.uint8), cv2.IMREAD_COLOR)
        except cv2.error:  # too many pixels
            return False, None
        return image is not None, image

    def get(self, propId: int) -> float:
        """Time of the image by the camera's clock (ms)."""
        return self._time_ms if propId == cv2.CAP_PROP_POS_MSEC else 0.0

    def release(self) -> None:
        self._response.close()


def opened(camera: MjpegCamera, size: tuple[int, int], fps: float) -> MjpegCapture:
    """Raises OpenError and AccessDenied."""
    request = Request(camera.url)
    try:
        if (known := netrc.netrc().authenticators(str(urlsplit(camera.url).hostname))) is not None:
            token = base64.b64encode(f"{known[0]}:{known[2]}".encode()).decode()
            request.add_header("Authorization", f"Basic {token}")
    except (FileNotFoundError, netrc.NetrcParseError):
        pass  # a camera without password needs none
    try:
        return MjpegCapture(build_opener(ProxyHandler({})).open(request, timeout=TIMEOUT_S))
    except HTTPError as error:
        if error.code == 401:
            raise AccessDenied(f"{camera.shown}: user and password: allowed: those in ~/.netrc for this host") from error
        raise OpenError(f"{camera.shown}: {error}") from error
    except (OSError, HTTPException) as error:
        raise OpenError(f"{camera.shown}: {error}") from error


MJPEG = SourceKind("mjpeg", "mjpeg:http://HOST/PATH", parse, "zenocap_mjpeg:opened")
