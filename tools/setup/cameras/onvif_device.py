"""Streams of an ONVIF device.  [ONVIF Core and Media service specifications]"""

import base64
import hashlib
import http.client
import secrets
import ssl
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from urllib.parse import quote, urlsplit
from xml.etree import ElementTree
from xml.sax.saxutils import escape

from zenocap.common.errors import UserError
from zenocap.common.runtime.foreign_text import printable
from zenocap.tools.setup.cameras.onvif_discovery import OnvifDevice, host_of, parsed
from zenocap.tools.setup.cameras.onvif_http import MOST_BYTES, OnvifHttp, User, trusted

AT_ONCE = 16  # devices
MOST_PROFILES = 32
DEVICE_PATH = "/onvif/device_service"  # ONVIF Core 5.1.1
SOAP = "{http://www.w3.org/2003/05/soap-envelope}"
TDS, TRT = "http://www.onvif.org/ver10/device/wsdl", "http://www.onvif.org/ver10/media/wsdl"
TT = "{http://www.onvif.org/ver10/schema}"
WSSE = "http://docs.oasis-open.org/wss/2004/01/oasis-200401-wss-"
DIGEST = f"{WSSE}username-token-profile-1.0#PasswordDigest"


@dataclass(frozen=True)
class OnvifStream:
    """A profile.  encoding, size: (width, height) px, as the device states them.  address: RTSP, without user."""

    profile: str
    encoding: str
    size: tuple[int, int]
    address: str


@dataclass(frozen=True)
class AskedDevice:
    """A device with its streams.  problem: why they are not known; empty otherwise."""

    device: OnvifDevice
    streams: tuple[OnvifStream, ...] = ()
    problem: str = ""


def asked_devices(
    devices: Sequence[OnvifDevice], user: User | None, tls: ssl.SSLContext | None = None
) -> list[AskedDevice]:
    """Ask all devices beside each other.  tls: of `trusted`, by default the system's certificates."""
    context = tls or trusted()
    with ThreadPoolExecutor(min(AT_ONCE, max(1, len(devices)))) as pool:
        return list(pool.map(lambda device: _asked(device, user, context), devices))


def _asked(device: OnvifDevice, user: User | None, tls: ssl.SSLContext) -> AskedDevice:
    try:
        streams = tuple(streams_of(device.address, user, tls))
    except UserError as error:
        return AskedDevice(device, problem=str(error).removeprefix(f"{device.address}: "))
    except (ValueError, IndexError, OverflowError) as error:  # of an address, a challenge, or a time
        return AskedDevice(device, problem=f"its answer cannot be read: {printable(str(error))}")
    return AskedDevice(device, streams, "" if streams else "it has no video stream")


def device_address(text: str) -> str:
    """Address of a device service for HOST, HOST:PORT or a URL.  Raises UserError."""
    address = text if "://" in text else f"http://{text}{DEVICE_PATH}"
    if host_of(address) is None:
        raise UserError(f"--onvif {text}: allowed: HOST, HOST:PORT, or http://HOST/..., https://HOST/...")
    return address


def streams_of(address: str, user: User | None, tls: ssl.SSLContext | None = None) -> list[OnvifStream]:
    """Streams of a device, in its order.  address: of the device service.  Raises UserError with the device's reason.

    Requests go to the host and port of `address` only, whatever the device answers.  Only RTSP addresses are taken.
    """
    device = _Device(address, user, tls or trusted())
    found = device.call(f'<m:GetCapabilities xmlns:m="{TDS}"><m:Category>Media</m:Category></m:GetCapabilities>')
    media = next((one.text or "" for part in found.iter(f"{TT}Media") for one in part.iter(f"{TT}XAddr")), "")
    if not media:
        raise UserError(f"{address}: it has no media service, so no stream")
    device.path = urlsplit(media).path or device.path
    streams = []
    profiles = device.call(f'<m:GetProfiles xmlns:m="{TRT}"/>').iter(f"{{{TRT}}}Profiles")
    for profile in list(profiles)[:MOST_PROFILES]:
        token = profile.get("token", "")
        answer = device.call(
            f'<m:GetStreamUri xmlns:m="{TRT}" xmlns:t="{TT[1:-1]}"><m:StreamSetup><t:Stream>RTP-Unicast</t:Stream>'
            "<t:Transport><t:Protocol>RTSP</t:Protocol></t:Transport></m:StreamSetup>"
            f"<m:ProfileToken>{escape(token)}</m:ProfileToken></m:GetStreamUri>"
        )
        encoder = profile.find(f"{TT}VideoEncoderConfiguration")
        stream = next((one.text or "" for one in answer.iter(f"{TT}Uri")), "").strip()
        if encoder is not None and host_of(stream, ("rtsp", "rtsps")):
            name = profile.findtext(f"{TT}Name") or token
            streams.append(OnvifStream(name, encoder.findtext(f"{TT}Encoding") or "", _size(encoder), stream))
    return streams


def with_user(device: OnvifDevice, stream: OnvifStream, user: User | None) -> str:
    """RTSP address with name and password, unless it has a user already or is of another host than the device."""
    parts = urlsplit(stream.address)
    if user is None or "@" in parts.netloc or parts.hostname != host_of(device.address):
        return stream.address
    return parts._replace(netloc=f"{quote(user.name, safe='')}:{quote(user.password, safe='')}@{parts.netloc}").geturl()


def _size(encoder: ElementTree.Element) -> tuple[int, int]:
    resolution = encoder.find(f"{TT}Resolution")
    if resolution is None:
        return 0, 0
    width, height = (resolution.findtext(f"{TT}{side}") or "" for side in ("Width", "Height"))
    return (int(width), int(height)) if width.isdigit() and height.isdigit() and len(width + height) < 12 else (0, 0)


class _Device:
    """Requests to one device.  path: of the service that is asked."""

    def __init__(self, address: str, user: User | None, tls: ssl.SSLContext) -> None:
        self.path = urlsplit(address).path or DEVICE_PATH
        self._address, self._user, self._http = address, user, OnvifHttp(address, user, tls)
        # Devices refuse passwords whose time is not theirs, and many have never been set.
        self._ahead = timedelta() if user is None else self._clock_ahead()

    def call(self, body: str) -> ElementTree.Element:
        """The answer to a request.  Raises UserError."""
        answer = self._posted(self._header, body)
        fault = answer.find(f"{SOAP}Body/{SOAP}Fault")
        if fault is None:
            return answer
        codes = " ".join(one.text or "" for one in fault.iter(f"{SOAP}Value"))
        text = next((one.text or "" for one in fault.iter(f"{SOAP}Text")), "") or codes or "no reason given"
        if "NotAuthorized" in codes or "authori" in text.lower():
            reason = "user or password is wrong" if self._user else "it wants a user: --user NAME"
            raise UserError(f"{self._address}: {reason}")
        raise UserError(f"{self._address}: {text}")

    def _header(self) -> str:
        return "" if self._user is None else _security(self._user, datetime.now(UTC) + self._ahead)

    def _clock_ahead(self) -> timedelta:
        """The device's clock minus that of this machine; 0 where unknown."""
        answer = self._posted(str, f'<m:GetSystemDateAndTime xmlns:m="{TDS}"/>')
        found = next(answer.iter(f"{TT}UTCDateTime"), None)
        if found is None:
            return timedelta()
        try:
            year, month, day = (int(found.findtext(f"{TT}Date/{TT}{key}") or "") for key in ("Year", "Month", "Day"))
            hour, minute, second = (int(found.findtext(f"{TT}Time/{TT}{k}") or "") for k in ("Hour", "Minute", "Second"))
            return datetime(year, month, day, hour, minute, min(second, 59), tzinfo=UTC) - datetime.now(UTC)
        except (ValueError, OverflowError):
            return timedelta()

    def _posted(self, header: Callable[[], str], body: str) -> ElementTree.Element:
        def envelope() -> bytes:
            own = "" if self._http.is_authenticated else header()
            text = f'<e:Envelope xmlns:e="{SOAP[1:-1]}"><e:Header>{own}</e:Header><e:Body>{body}</e:Body></e:Envelope>'
            return f'<?xml version="1.0" encoding="UTF-8"?>{text}'.encode()

        answer = self._http.post(self.path, envelope)
        tree = parsed(answer.text) if len(answer.text) <= MOST_BYTES else None
        if tree is None or tree.tag != f"{SOAP}Envelope":
            if answer.status == http.client.UNAUTHORIZED:
                raise UserError(f"{self._address}: user or password is wrong")
            raise UserError(f"{self._address}: its answer (HTTP {answer.status}) is not that of an ONVIF device")
        return tree


def _security(user: User, created: datetime) -> str:
    """Header with the digest of the password.  [WS-Security UsernameToken Profile 1.0, 3.1]"""
    nonce, stamp = secrets.token_bytes(16), created.strftime("%Y-%m-%dT%H:%M:%SZ")
    digest = base64.b64encode(hashlib.sha1(nonce + stamp.encode() + user.password.encode()).digest()).decode()
    return (
        f'<s:Security xmlns:s="{WSSE}wssecurity-secext-1.0.xsd" xmlns:u="{WSSE}wssecurity-utility-1.0.xsd">'
        f'<s:UsernameToken><s:Username>{escape(user.name)}</s:Username><s:Password Type="{DIGEST}">{digest}</s:Password>'
        f"<s:Nonce>{base64.b64encode(nonce).decode()}</s:Nonce><u:Created>{stamp}</u:Created></s:UsernameToken></s:Security>"
    )
