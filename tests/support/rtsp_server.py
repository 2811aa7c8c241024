"""Network camera: RTSP with JPEG over RTP in one connection.  [RFC 2326, RFC 2435]"""

import socket
import struct
import threading
import time
from contextlib import suppress

import cv2
import numpy as np

from tests.support.mjpeg_server import with_time
from zenocap.common.closable import Closable

CLOCK_HZ = 90_000
PAYLOAD = 1400  # bytes of image data in a packet
PATH = "/stream"


def jpeg_parts(data: bytes) -> tuple[bytes, bytes]:
    """Quantization tables and entropy-coded data of a baseline JPEG with standard Huffman tables."""
    tables: dict[int, bytes] = {}
    at = 2
    while True:
        marker, length = struct.unpack_from(">HH", data, at)
        content = data[at + 4 : at + 2 + length]
        at += 2 + length
        if marker == 0xFFDB:
            for begin in range(0, len(content), 65):
                tables[content[begin] & 15] = content[begin + 1 : begin + 65]
        if marker == 0xFFDA:
            return tables[0] + tables[1], data[at : data.rindex(b"\xff\xd9")]


def rtp_packets(image: np.ndarray, sequence: int, stamp: int) -> list[bytes]:
    """The packets of one image, whose sides are multiples of 16 px."""
    height, width = image.shape[:2]
    tables, scan = jpeg_parts(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 80])[1].tobytes())
    packets = []
    for offset in range(0, len(scan), PAYLOAD):
        last = offset + PAYLOAD >= len(scan)
        head = struct.pack(">BBHII", 0x80, 26 | last << 7, (sequence + len(packets)) & 0xFFFF, stamp & 0xFFFFFFFF, 7)
        jpeg = struct.pack(">IBBBB", offset, 1, 255, width // 8, height // 8)  # type 1: 4:2:0; Q 255: tables are sent
        own = struct.pack(">BBH", 0, 0, len(tables)) + tables if offset == 0 else b""
        packets.append(head + jpeg + own + scan[offset : offset + PAYLOAD])
    return packets


class RtspServer(Closable):
    """Serves rtsp://127.0.0.1:PORT/stream; another path is 404.  `cut` ends the connections, and new ones are refused."""

    def __init__(self, size: tuple[int, int] = (320, 240), fps: float = 30.0) -> None:
        self.size, self.fps, self.sent = size, fps, 0
        self._clients: list[socket.socket] = []
        self._threads: list[threading.Thread] = []
        self._listener: socket.socket | None = None
        self.port = 0
        self.resume()
        self.url = f"rtsp://127.0.0.1:{self.port}{PATH}"

    def resume(self) -> None:
        """Accept connections."""
        self._listener = socket.create_server(("127.0.0.1", self.port), reuse_port=False)
        self.port = self._listener.getsockname()[1]
        self._start(self._accept, self._listener)

    def cut(self) -> None:
        listener, self._listener = self._listener, None
        for one in (*self._clients, *([listener] if listener else [])):
            with suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
            one.close()
        self._clients.clear()
        for thread in self._threads:
            thread.join(5)
        self._threads.clear()

    def _start(self, work: object, *arguments: object) -> None:
        thread = threading.Thread(target=work, args=arguments, daemon=True)
        self._threads.append(thread)
        thread.start()

    def _accept(self, listener: socket.socket) -> None:
        while True:
            try:
                client, _ = listener.accept()
            except OSError:
                return
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._clients.append(client)
            self._start(self._serve, client)

    def _serve(self, client: socket.socket) -> None:
        lock = threading.Lock()
        try:
            with client.makefile("rb") as reader:
                while line := reader.readline():
                    if line[:1] == b"$":  # a report of the receiver: the line is part of it
                        continue
                    if line.split()[-1:] != [b"RTSP/1.0"]:
                        continue
                    method, url, _ = line.decode().split()
                    headers = {}
                    while (text := reader.readline().decode().strip()) != "":
                        name, _, value = text.partition(":")
                        headers[name.lower()] = value.strip()
                    with lock:
                        client.sendall(self._answer(method, url, headers))
                    if method == "PLAY":
                        self._start(self._play, client, lock)
                    if method == "TEARDOWN":
                        return
        except (OSError, ValueError):
            pass
        finally:
            client.close()

    def _answer(self, method: str, url: str, headers: dict[str, str]) -> bytes:
        status, more, body = "200 OK", [], ""
        match method:
            case "OPTIONS":
                more = ["Public: OPTIONS, DESCRIBE, SETUP, PLAY, TEARDOWN"]
            case "DESCRIBE" if not url.endswith(PATH):
                status = "404 Not Found"
            case "DESCRIBE":
                body = (
                    "v=0\r\no=- 1 1 IN IP4 127.0.0.1\r\ns=test\r\nc=IN IP4 127.0.0.1\r\nt=0 0\r\n"
                    f"m=video 0 RTP/AVP 26\r\na=control:track0\r\na=framerate:{self.fps:g}\r\n"
                )
                more = ["Content-Type: application/sdp", f"Content-Base: {url}/"]
            case "SETUP" if "TCP" not in headers.get("transport", ""):
                status = "461 Unsupported Transport"
            case "SETUP":
                more = ["Transport: RTP/AVP/TCP;unicast;interleaved=0-1", "Session: 1"]
            case _:
                more = ["Session: 1"]
        lines = [f"RTSP/1.0 {status}", f"CSeq: {headers.get('cseq', '0')}", *more, f"Content-Length: {len(body)}"]
        return ("\r\n".join(lines) + "\r\n\r\n" + body).encode()

    def _play(self, client: socket.socket, lock: threading.Lock) -> None:
        sequence, begin_s, k = 0, time.monotonic(), 0
        try:
            while True:
                image = with_time(self.size, time.monotonic_ns() // 1_000_000)
                packets = rtp_packets(image, sequence, round(k * CLOCK_HZ / self.fps))
                with lock:
                    client.sendall(b"".join(struct.pack(">cBH", b"$", 0, len(one)) + one for one in packets))
                sequence, k = sequence + len(packets), k + 1
                self.sent += 1
                time.sleep(max(0.0, begin_s + k / self.fps - time.monotonic()))
        except OSError:
            pass

    def close(self) -> None:
        self.cut()
