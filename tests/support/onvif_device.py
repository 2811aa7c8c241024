"""Simulated ONVIF device on the loopback interface, also over TLS."""

import base64
import hashlib
import re
import socket
import ssl
import struct
import threading
import time
from datetime import datetime
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import TracebackType
from xml.etree import ElementTree

from zenocap.tools.setup.cameras.onvif_discovery import GROUP

LOOPBACK = "127.0.0.1"
POLL_S = 0.02
ALONE_S = 120.0  # until the device of another worker or clone on this machine has ended
S = "{http://www.w3.org/2003/05/soap-envelope}"
NAMES = (
    'xmlns:e="http://www.w3.org/2003/05/soap-envelope" xmlns:tds="http://www.onvif.org/ver10/device/wsdl" '
    'xmlns:trt="http://www.onvif.org/ver10/media/wsdl" xmlns:tt="http://www.onvif.org/ver10/schema" '
    'xmlns:ter="http://www.onvif.org/ver10/error"'
)
YEAR = 2001  # of the device's clock, which was never set


def alone() -> socket.socket:
    """A socket that one process of the machine can have: all devices would answer each other's probes.

    It holds the probe's port as one of TCP, which nothing else uses.
    """
    held = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    end_s = time.monotonic() + ALONE_S
    while True:
        try:
            held.bind((LOOPBACK, GROUP[1]))
            return held
        except OSError:
            if time.monotonic() > end_s:
                held.close()
                raise
            time.sleep(0.02)


class SimulatedOnvif:
    """A device with one profile, alone on this machine.  streams: RTSP addresses.  user: (name, password) that it wants.

    matches: answer to a probe instead of its own.  replies: SOAP bodies by the name of the request, instead of its own.
    tls: for https.  digest: algorithms of HTTP digest that it wants of every request, instead of ONVIF's password.
    """

    def __init__(
        self, streams: dict[str, str], user: tuple[str, str] | None = None, matches: str | None = None,
        replies: dict[str, str] | None = None, tls: ssl.SSLContext | None = None, digest: tuple[str, ...] = (),
    ) -> None:  # fmt: skip
        self.streams, self.user, self.replies, self.digest = streams, user, replies or {}, digest
        self.nonces = 1
        self.requests: list[str] = []
        device = self

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers["Content-Length"]))
                if device.digest and not device.knows(self.headers.get("Authorization", ""), self.path):
                    self.send_response(401)
                    self.send_header("WWW-Authenticate", 'Basic realm="camera"')
                    for algorithm in device.digest:
                        challenge = (
                            f'realm="camera, 1", nonce="n{device.nonces}", algorithm={algorithm}, qop="auth,auth-int"'
                        )
                        self.send_header("WWW-Authenticate", f"Digest {challenge}")
                    self.send_header("Content-Length", "0")
                    self.end_headers()
                    return
                text = f"<e:Envelope {NAMES}><e:Body>{device.answer(body)}</e:Body></e:Envelope>".encode()
                self.send_response(200)
                self.send_header("Content-Length", str(len(text)))
                self.end_headers()
                self.wfile.write(text)

            def log_message(self, format: str, *args: object) -> None: ...

        self._alone = alone()
        self._http = ThreadingHTTPServer((LOOPBACK, 0), Handler)
        if tls is not None:
            self._http.socket = tls.wrap_socket(self._http.socket, server_side=True, do_handshake_on_connect=False)
        self.host = f"{LOOPBACK}:{self._http.server_port}"
        self.address = f"{'http' if tls is None else 'https'}://{self.host}/onvif/device_service"
        self._matches = matches or (
            f"<d:ProbeMatch><d:Scopes>onvif://www.onvif.org/name/Hall%20camera onvif://www.onvif.org/hardware/X1</d:Scopes>"
            f"<d:XAddrs>http://10.0.0.9/elsewhere {self.address}</d:XAddrs></d:ProbeMatch>"
        )
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._udp.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._udp.bind(("", GROUP[1]))
        member = struct.pack("4s4s", socket.inet_aton(GROUP[0]), socket.inet_aton(LOOPBACK))
        self._udp.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
        self._udp.settimeout(POLL_S)
        self._stop = threading.Event()
        self._threads = [
            threading.Thread(target=self._http.serve_forever, args=(POLL_S,)), threading.Thread(target=self._discovery)
        ]  # fmt: skip

    def __enter__(self) -> "SimulatedOnvif":
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._stop.set()
        self._http.shutdown()
        for thread in self._threads:
            thread.join()
        self._http.server_close()
        self._udp.close()
        self._alone.close()

    def _discovery(self) -> None:
        while not self._stop.is_set():
            try:
                probe, sender = self._udp.recvfrom(65536)
            except TimeoutError:
                continue
            if b"NetworkVideoTransmitter" in probe:
                envelope = (
                    '<e:Envelope xmlns:e="http://www.w3.org/2003/05/soap-envelope" '
                    f'xmlns:d="http://schemas.xmlsoap.org/ws/2005/04/discovery"><e:Body><d:ProbeMatches>{self._matches}'
                    "</d:ProbeMatches></e:Body></e:Envelope>"
                )
                self._udp.sendto(envelope.encode(), sender)

    def knows(self, authorization: str, path: str) -> bool:
        """True for the right answer to the present nonce.  [RFC 7616, 3.4.1; the worked form of its section 3.9.1]"""
        fields = {
            key: quoted or plain for key, quoted, plain in re.findall(r'(\w+)=(?:"([^"]*)"|([^,\s]*))', authorization)
        }
        if self.user is None or fields.get("nonce") != f"n{self.nonces}" or fields.get("uri") != path:
            return False
        new = {"MD5": hashlib.md5, "SHA-256": hashlib.sha256}[fields["algorithm"]]
        secret, request = (
            new(text.encode()).hexdigest() for text in (f"{self.user[0]}:camera, 1:{self.user[1]}", f"POST:{path}")
        )
        text = f"{secret}:{fields['nonce']}:{fields['nc']}:{fields['cnonce']}:{fields['qop']}:{request}"
        return fields["algorithm"] in self.digest and fields["response"] == new(text.encode()).hexdigest()

    def answer(self, body: bytes) -> str:
        tree = ElementTree.fromstring(body)
        request = next(iter(tree.find(f"{S}Body") or ()))
        name = request.tag.split("}")[1]
        self.requests.append(name)
        if name in self.replies:
            return self.replies[name]
        if name == "GetSystemDateAndTime":
            return (
                "<tds:GetSystemDateAndTimeResponse><tds:SystemDateAndTime><tt:UTCDateTime><tt:Time><tt:Hour>1</tt:Hour>"
                "<tt:Minute>2</tt:Minute><tt:Second>3</tt:Second></tt:Time><tt:Date>"
                f"<tt:Year>{YEAR}</tt:Year><tt:Month>2</tt:Month><tt:Day>3</tt:Day></tt:Date></tt:UTCDateTime>"
                "</tds:SystemDateAndTime></tds:GetSystemDateAndTimeResponse>"
            )
        if self.user is not None and not self.digest and not self._allowed(tree):
            return (
                "<e:Fault><e:Code><e:Value>e:Sender</e:Value><e:Subcode><e:Value>ter:NotAuthorized</e:Value></e:Subcode>"
                "</e:Code><e:Reason><e:Text>Sender not authorized</e:Text></e:Reason></e:Fault>"
            )
        if name == "GetCapabilities":
            return (
                "<tds:GetCapabilitiesResponse><tds:Capabilities><tt:Media>"
                "<tt:XAddr>http://10.0.0.9/onvif/media</tt:XAddr></tt:Media></tds:Capabilities></tds:GetCapabilitiesResponse>"
            )
        if name == "GetProfiles":
            profiles = "".join(
                f'<trt:Profiles token="{token}"><tt:Name>{token} stream</tt:Name><tt:VideoEncoderConfiguration>'
                "<tt:Encoding>H264</tt:Encoding><tt:Resolution><tt:Width>1280</tt:Width><tt:Height>720</tt:Height>"
                "</tt:Resolution></tt:VideoEncoderConfiguration></trt:Profiles>"
                for token in self.streams
            )
            return f"<trt:GetProfilesResponse>{profiles}</trt:GetProfilesResponse>"
        token = next(one.text or "" for one in request.iter() if one.tag.endswith("ProfileToken"))
        uri = self.streams[token].replace("&", "&amp;")
        return f"<trt:GetStreamUriResponse><trt:MediaUri><tt:Uri>{uri}</tt:Uri></trt:MediaUri></trt:GetStreamUriResponse>"

    def _allowed(self, tree: ElementTree.Element) -> bool:
        """True for the right digest of a time near that of the device's clock."""
        fields = {one.tag.split("}")[1]: one.text or "" for one in tree.iter()}
        if self.user is None or fields.get("Username") != self.user[0]:
            return False
        created = fields["Created"]
        digest = hashlib.sha1(base64.b64decode(fields["Nonce"]) + created.encode() + self.user[1].encode()).digest()
        return datetime.fromisoformat(created).year == YEAR and base64.b64encode(digest).decode() == fields["Password"]
