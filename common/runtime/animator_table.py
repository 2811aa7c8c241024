"""The `[animator]` table of a rig: where its page is, and to whom the animator sends every pose on.

Each output is a table of its own, and one that is there is on, unless it says `enabled = false`.  Nothing is sent, and
nobody is listened to, where there is none.
"""

from collections.abc import Mapping
from ipaddress import ip_address
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

Host = Annotated[str, Meta(min_length=1, max_length=253)]  # a name or a numeric address
Port = Annotated[int, Meta(ge=1, le=65535)]
StreamName = Annotated[str, Meta(min_length=1, max_length=64)]


class PageTable(msgspec.Struct, frozen=True, kw_only=True):
    """The live page.  host: the address of this machine that it is on; port: 0 for any free one.

    token: who opens the page must know it; an address that other machines can reach needs one.
    """

    enabled: bool = True
    host: Host = "127.0.0.1"
    port: Annotated[int, Meta(ge=0, le=65535)] = 8080
    token: Annotated[str, Meta(pattern=r"^[A-Za-z0-9_\-]{16,128}$")] | None = None


class VmcTable(msgspec.Struct, frozen=True, kw_only=True):
    """Virtual Motion Capture protocol: to a program that shows an avatar."""

    enabled: bool = True
    host: Host = "127.0.0.1"
    port: Port = 39539  # of a "marionette" in that protocol


class UdpTable(msgspec.Struct, frozen=True, kw_only=True):
    """JSON lines, one datagram for each pose."""

    enabled: bool = True
    host: Host = "127.0.0.1"
    port: Port = 39600


class FoxgloveTable(msgspec.Struct, frozen=True, kw_only=True):
    """A WebSocket that Foxglove and Lichtblick connect to.  host: the address of this machine that it is on."""

    enabled: bool = True
    host: Host = "127.0.0.1"
    port: Port = 8765


class LslTable(msgspec.Struct, frozen=True, kw_only=True):
    """A Lab Streaming Layer outlet.  stream: its name, by default the rig's.  reach: who may find it."""

    enabled: bool = True
    stream: StreamName | None = None
    reach: Literal["machine", "network"] = "machine"


class AnimatorTable(msgspec.Struct, frozen=True, kw_only=True):
    page: PageTable = PageTable()
    vmc: VmcTable | None = None
    udp: UdpTable | None = None
    foxglove: FoxgloveTable | None = None
    lsl: LslTable | None = None


# The tables inside, to tell a wrong key in one.
WITHIN: Mapping[str, type[msgspec.Struct]] = {
    "page": PageTable,
    "vmc": VmcTable,
    "udp": UdpTable,
    "foxglove": FoxgloveTable,
    "lsl": LslTable,
}


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach `host`."""
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def open_page_problem(page: PageTable) -> str | None:
    """What forbids a page at its address; None when nothing does."""
    if page.enabled and page.token is None and not is_loopback(page.host):
        return "allowed: an address of this machine alone, such as 127.0.0.1, or any together with page.token"
    return None
