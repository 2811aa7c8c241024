"""ONVIF cameras of the local network by multicast.  [OASIS WS-Discovery, April 2005]

Three fixed messages (see also `onvif_device`) stand here instead of a SOAP library, which brings some ten packages with it.
"""

import socket
import struct
import time
import uuid
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from urllib.parse import unquote, urlsplit
from xml.etree import ElementTree

from zenocap.common.errors import UserError

GROUP = ("239.255.255.250", 3702)
PATIENCE_S = 3.0  # for answers, which devices delay by up to half a second; chosen by hand
REPEATED_S = 1.0  # after which the probe is sent once more, because datagrams are lost; chosen by hand
MOST_BYTES = 65_536  # of an answer
MOST_DEVICES = 256
DISCOVERY = "{http://schemas.xmlsoap.org/ws/2005/04/discovery}"
SCOPE = "onvif://www.onvif.org/"
PROBE = """<?xml version="1.0" encoding="UTF-8"?>
<e:Envelope xmlns:e="http://www.w3.org/2003/05/soap-envelope" xmlns:w="http://schemas.xmlsoap.org/ws/2004/08/addressing"
 xmlns:d="http://schemas.xmlsoap.org/ws/2005/04/discovery" xmlns:dn="http://www.onvif.org/ver10/network/wsdl"><e:Header>
<w:MessageID>uuid:{id}</w:MessageID><w:To>urn:schemas-xmlsoap-org:ws:2005:04:discovery</w:To>
<w:Action>http://schemas.xmlsoap.org/ws/2005/04/discovery/Probe</w:Action></e:Header>
<e:Body><d:Probe><d:Types>dn:NetworkVideoTransmitter</d:Types></d:Probe></e:Body></e:Envelope>"""


@dataclass(frozen=True)
class OnvifDevice:
    """A device.  address: of its device service, an http or https URL.  name, hardware: as it states them, or empty."""

    address: str
    name: str = ""
    hardware: str = ""


def found_devices(interface: str | None = None, patience_s: float = PATIENCE_S) -> list[OnvifDevice]:
    """Devices that answer a probe within `patience_s`, all of which is waited, sorted by address.

    interface: own IPv4 address on the network that is probed; None for the one of the default route.  Only IPv4.
    Raises UserError when the probe cannot be sent.
    """
    found: dict[str, OnvifDevice] = {}
    probe = PROBE.format(id=uuid.uuid4()).encode()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        try:
            sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, struct.pack("b", 1))
            if interface is not None:
                sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(interface))
            sender.sendto(probe, GROUP)
        except OSError as error:
            where = "the network of the default route" if interface is None else f"--interface {interface}"
            raise UserError(
                f"{where}: no probe can be sent: {error}; allowed: an own IPv4 address, such as 192.168.1.5"
            ) from None
        begin_s = time.monotonic()
        again = False
        while (left_s := begin_s + patience_s - time.monotonic()) > 0 and len(found) < MOST_DEVICES:
            if not again and left_s < patience_s - REPEATED_S:
                again = True
                sender.sendto(probe, GROUP)
            sender.settimeout(min(left_s, 0.25))
            try:
                answer, sender_address = sender.recvfrom(MOST_BYTES)
            except TimeoutError:
                continue
            for device in devices_of(answer, sender_address[0]):
                found.setdefault(device.address, device)
    return [found[address] for address in sorted(found)]


def devices_of(answer: bytes, host: str) -> Iterable[OnvifDevice]:
    """Devices of an answer from a host; none where it is no answer to a probe.

    Of several addresses the first at that host is taken: an answer must not lead requests, with a password, to others.
    """
    tree = parsed(answer)
    for match in () if tree is None else tree.iter(f"{DISCOVERY}ProbeMatch"):
        scopes = (match.findtext(f"{DISCOVERY}Scopes") or "").split()
        for address in (match.findtext(f"{DISCOVERY}XAddrs") or "").split():
            if host_of(address) == host:
                yield OnvifDevice(address, _scope(scopes, "name"), _scope(scopes, "hardware"))
                break


def host_of(address: str, schemes: Collection[str] = ("http", "https")) -> str | None:
    """Host of a URL with one of these schemes, or None."""
    try:
        parts = urlsplit(address)
        return parts.hostname if parts.scheme in schemes and parts.port != 0 else None
    except ValueError:
        return None


def parsed(text: bytes) -> ElementTree.Element | None:
    """The XML document, or None for what is none, or declares entities, which can grow without limit."""
    if b"<!DOCTYPE" in text or b"<!ENTITY" in text or b"\0" in text:  # UTF-16 has zeros
        return None
    try:
        return ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError, LookupError):
        return None


def _scope(scopes: Iterable[str], kind: str) -> str:
    begin = f"{SCOPE}{kind}/"
    return next((unquote(scope.removeprefix(begin)) for scope in scopes if scope.startswith(begin)), "")
