"""The `[animator]` table of a rig: address of the page, and the outputs to which poses are sent.

Each output has its own table.  A table that is present enables its output, unless it contains `enabled = false`.
Without a table nothing is sent and no port is opened.
"""

from ipaddress import ip_address
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from zenocap.common.rig.table_errors import choice_problem

SMOOTHINGS = ("off", "one-euro")
MIN_HZ, MAX_HZ, MAX_BETA = 0.1, 30.0, 100.0  # of smooth_hz and smooth_beta; chosen by hand

Host = Annotated[str, Meta(min_length=1, max_length=253)]  # a name or a numeric address
Port = Annotated[int, Meta(ge=1, le=65535)]
TRACKERS = ("hip", "chest", "left_foot", "right_foot", "left_knee", "right_knee", "left_elbow", "right_elbow")  # of VRChat
ANY_ORIGIN = "*"
Origin = Annotated[str, Meta(pattern=r"^(\*|[a-z][a-z0-9+.\-]*://[^/\s]*)$", max_length=253)]  # of web pages, or ANY_ORIGIN
StreamName = Annotated[str, Meta(min_length=1, max_length=64)]


class PageTable(msgspec.Struct, frozen=True, kw_only=True):
    """The live page.  host: the local address to listen on.  port: 0 for any free one.

    token: access token of the page, required for an address that other machines can reach.
    origins: of web pages that may connect beside the page itself, such as "https://rig.example".
    """

    enabled: bool = True
    host: Host = "127.0.0.1"
    port: Annotated[int, Meta(ge=0, le=65535)] = 8080
    token: Annotated[str, Meta(pattern=r"^[A-Za-z0-9_\-]{16,128}$")] | None = None
    origins: tuple[Origin, ...] = ()


class OutputTable(msgspec.Struct, frozen=True, kw_only=True):
    """Of any output.  enabled: whether it is opened."""

    enabled: bool = True


class VmcTable(OutputTable, frozen=True, kw_only=True):
    """Output in the Virtual Motion Capture protocol, to a program that displays an avatar."""

    host: Host = "127.0.0.1"
    port: Port = 39539  # default port of a "marionette" (receiver) in that protocol


class VrchatTable(OutputTable, frozen=True, kw_only=True):
    """Output of trackers to VRChat, by OSC.

    trackers: body parts that are sent; the number of each in VRChat is its place in TRACKERS, from 1.
    head: what VRChat aligns its tracking space with: nothing, the position of the head, or also its heading.
    """

    host: Host = "127.0.0.1"
    port: Port = 9000  # on which VRChat receives by default
    trackers: tuple[str, ...] = TRACKERS
    head: str = "position"


class UdpTable(OutputTable, frozen=True, kw_only=True):
    """Output of JSON lines, one UDP datagram per pose."""

    host: Host = "127.0.0.1"
    port: Port = 39600


# The web application, and the programs that show its pages from files.
FOXGLOVE_ORIGINS = ("https://app.foxglove.dev", "file://")


class FoxgloveTable(OutputTable, frozen=True, kw_only=True):
    """WebSocket server for Foxglove and Lichtblick.  host: the local address to listen on.

    origins: of web pages that may connect beside those of this machine; "*" for all.  Programs have no origin.
    """

    host: Host = "127.0.0.1"
    port: Port = 8765
    origins: tuple[Origin, ...] = FOXGLOVE_ORIGINS


class LslTable(OutputTable, frozen=True, kw_only=True):
    """A Lab Streaming Layer outlet.  stream: its name; default: the rig's.  reach: network scope in which it is visible."""

    stream: StreamName | None = None
    reach: Literal["machine", "network"] = "machine"


class RosTable(OutputTable, frozen=True, kw_only=True):
    """Publisher for ROS 2 with rmw_zenoh.

    connect: Zenoh endpoint of a router that the nodes of ROS use.  domain: ROS_DOMAIN_ID.  namespace: of the node, of its
    topic and of the frames of body parts; default: the rig's name.  frame: name of the world's frame.  humble: whether
    ROS 2 Humble receives, whose keys have no type hashes.
    """

    connect: str = "tcp/127.0.0.1:7447"  # where rmw_zenoh's own nodes connect
    domain: Annotated[int, Meta(ge=0, le=232)] = 0
    namespace: str | None = None
    frame: str = "map"  # of REP 105
    humble: bool = False


class AnimatorTable(msgspec.Struct, frozen=True, kw_only=True):
    """smooth: filter of the live poses on the page and in all outputs; the published and recorded poses stay as they are.

    smooth_hz: cut-off frequency at rest (Hz).  smooth_beta: its rise per m/s or rad/s (Hz).
    outputs: by the name of their tables; see `zenocap.common.rig.outputs`.
    """

    smooth: str = "off"
    smooth_hz: float | None = None
    smooth_beta: float | None = None
    page: PageTable = PageTable()
    outputs: dict[str, OutputTable] = {}


HEAD_ALIGNMENTS = ("off", "position", "position-and-yaw")  # values of `head` of VRChat


def smoothing_problem(smooth: str, hz: float | None, beta: float | None) -> str | None:
    """Text for a value that is not allowed, which begins with its key; None without one."""
    if smooth not in SMOOTHINGS:
        return choice_problem("smooth", smooth, SMOOTHINGS)
    for key, value, low, high in (("smooth_hz", hz, MIN_HZ, MAX_HZ), ("smooth_beta", beta, 0.0, MAX_BETA)):
        if value is None:
            continue
        if smooth == SMOOTHINGS[0]:
            return f"{key} = {value!r}: allowed: only with smooth = {SMOOTHINGS[1]!r}"
        if not low <= value <= high:  # not a number as well
            return f"{key} = {value!r}: allowed: {low:g} to {high:g}"
    return None


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach `host`."""
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def open_page_problem(page: PageTable) -> str | None:
    """Reason why a page is not allowed at its address; None when it is."""
    if page.enabled and page.token is None and not is_loopback(page.host):
        return "allowed: an address of this machine only, such as 127.0.0.1, or any together with page.token"
    return None
