"""A network camera: JPEG images over HTTP (multipart/x-mixed-replace), with a time code in each."""

import base64
import threading
import time
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import cv2
import numpy as np

from zenocap.common.closable import Closable

BITS = 24  # of the time code: milliseconds of the monotonic clock


def with_time(size: tuple[int, int], value_ms: int) -> np.ndarray:
    """A grey image whose upper half has the lowest bits of a time in milliseconds as black and white stripes."""
    image = np.full((size[1], size[0], 3), 90, np.uint8)
    for bit in range(BITS):
        left, right = bit * size[0] // BITS, (bit + 1) * size[0] // BITS
        image[: size[1] // 2, left:right] = 255 if value_ms >> bit & 1 else 0
    return image


def time_in(image: np.ndarray) -> int:
    """The time that `with_time` has drawn, ms modulo 2^24."""
    height, width = image.shape[:2]
    centres = [(2 * bit + 1) * width // (2 * BITS) for bit in range(BITS)]
    return sum(int(image[height // 4, column].mean() > 128) << bit for bit, column in enumerate(centres))


class MjpegServer(Closable):
    """Serves http://127.0.0.1:PORT/stream until it is closed; another path is 404.  opened: number of connections."""

    def __init__(
        self, size: tuple[int, int], fps: float, picture: Callable[[], np.ndarray] | None = None,
        user: tuple[str, str] | None = None, clock_s: Callable[[], float] | None = None,
    ) -> None:  # fmt: skip
        """picture: what the camera sees now; None for the time code.  user: name and password without which it is 401.

        clock_s: time of each image by the camera's clock, which is sent (X-Timestamp).
        """
        self.user, self.clock_s = user, clock_s
        self.size, self.fps, self.sent, self.opened, self.open = size, fps, 0, 0, True
        self.picture = picture or (lambda: with_time(self.size, time.monotonic_ns() // 1_000_000))
        outer = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                outer.serve(self)

            def log_message(self, format: str, *args: object) -> None:
                pass

        ThreadingHTTPServer.allow_reuse_address = True
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        self.port = self._server.server_address[1]
        self.url = f"http://127.0.0.1:{self.port}/stream"
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.05,), daemon=True)
        self._thread.start()

    def serve(self, request: BaseHTTPRequestHandler) -> None:
        if request.path != "/stream":
            request.send_error(404)
            return
        if self.user is not None:
            token = base64.b64encode(":".join(self.user).encode()).decode()
            if request.headers["Authorization"] != f"Basic {token}":
                request.send_error(401)
                return
        self.opened += 1
        request.send_response(200)
        request.send_header("Content-Type", "multipart/x-mixed-replace; boundary=frame")
        request.end_headers()
        due = time.monotonic()
        try:
            while self.open:
                stamp = b"" if self.clock_s is None else b"X-Timestamp: %.6f\r\n" % self.clock_s()
                data = cv2.imencode(".jpg", self.picture())[1].tobytes()
                request.wfile.write(b"--frame\r\nContent-Type: image/jpeg\r\n%b" % stamp)
                request.wfile.write(b"Content-Length: %d\r\n\r\n" % len(data))
                request.wfile.write(data + b"\r\n")
                self.sent += 1
                due += 1 / self.fps
                time.sleep(max(0.0, due - time.monotonic()))
        except OSError:
            pass

    def close(self) -> None:
        self.open = False
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()
