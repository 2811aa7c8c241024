"""The `[animator]` table of a rig: to whom the animator sends every pose on.

Each output is a table of its own, and one that is there is on, unless it says `enabled = false`.  Nothing is sent, and
nobody is listened to, where there is none.
"""

from collections.abc import Mapping
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

Host = Annotated[str, Meta(min_length=1, max_length=253)]  # a name or a numeric address
Port = Annotated[int, Meta(ge=1, le=65535)]
StreamName = Annotated[str, Meta(min_length=1, max_length=64)]


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
    vmc: VmcTable | None = None
    udp: UdpTable | None = None
    foxglove: FoxgloveTable | None = None
    lsl: LslTable | None = None


# The tables inside, to tell a wrong key in one.
WITHIN: Mapping[str, type[msgspec.Struct]] = {
    "vmc": VmcTable,
    "udp": UdpTable,
    "foxglove": FoxgloveTable,
    "lsl": LslTable,
}
