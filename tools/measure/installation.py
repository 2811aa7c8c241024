"""Cores, memory, network and disk of an installation, from the costs of its parts.  Pure."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import ceil, sqrt
from typing import Literal

from zenocap.common.errors import UserError
from zenocap.common.topics import PREVIEW, SCENE_POINTS
from zenocap.tools.measure.unit_costs import LOOP_USABLE, USABLE, Costs

Method = Literal["two-view", "hybrid"]

MAX_CAMERAS, MAX_ROUTERS = 10_000, 1_000
TRACE_EVENT_BYTES = 11.0  # of an event in an input trace: index and time in MessagePack


@dataclass(frozen=True)
class Installation:
    """cameras: of all rigs, equally many each.  size: (width, height) px.  pages: open pages of each rig.

    decoded: images come from cameras or videos and are decoded; False for images in memory.  previews, silhouettes:
    whether viewers of a two-view rig publish them.  log: whether takes are written; foxglove: with channels for it.
    routers: routers to which equal numbers of rigs are connected; with more than one of them, below one more; 0: a mesh of
    peers.  cores: of each machine; None: unknown.
    """

    cameras: int
    fps: float
    size: tuple[int, int]
    method: Method = "hybrid"
    rigs: int = 1
    pages: int = 0
    decoded: bool = True
    previews: bool = True
    log: bool = True
    foxglove: bool = True
    routers: int = 0
    cores: int | None = None

    @property
    def views(self) -> int:
        """Cameras of each rig."""
        return self.cameras // self.rigs

    @property
    def megapixels(self) -> float:
        return self.size[0] * self.size[1] / 1e6


def checked(installation: Installation) -> Installation:
    """Return the installation if it is possible.  Raises UserError."""
    cameras, rigs = installation.cameras, installation.rigs
    if not 2 <= cameras <= MAX_CAMERAS:
        raise UserError(f"--cameras {cameras}: allowed: 2 to {MAX_CAMERAS}")
    if not 1 <= rigs <= cameras // 2 or cameras % rigs:
        raise UserError(f"--rigs {rigs}: allowed with --cameras {cameras}: 1 to {cameras // 2}, and a divisor of {cameras}")
    if installation.method == "two-view" and installation.views != 2:
        raise UserError(f"--method two-view: allowed with two cameras in a rig; these have {installation.views}")
    if not 0 <= installation.routers <= min(MAX_ROUTERS, rigs):
        raise UserError(f"--routers {installation.routers}: allowed: 0 to {min(MAX_ROUTERS, rigs)}, one rig each")
    return installation


@dataclass(frozen=True)
class ServiceDemand:
    """Demand of one kind of process.  cores: of one of them.  number: in the installation.  memory_mb: of one."""

    service: str
    number: int
    cores: float
    memory_mb: float


@dataclass(frozen=True)
class Flow:
    """Messages of one kind.  each: publishers in a rig.  hz: messages per second of one.  bytes: of one on the network.

    payload: without the overhead of the network.  receivers: processes of the rig that receive it, the log among them.
    central: whether it is health or a pose, which a monitor of all rigs reads.
    """

    name: str
    each: int
    hz: float
    bytes: float
    payload: float
    receivers: int
    central: bool = False

    @property
    def messages(self) -> float:
        """Messages per second in a rig."""
        return self.each * self.hz

    @property
    def rate(self) -> float:
        """Bytes per second in a rig."""
        return self.messages * self.bytes


@dataclass(frozen=True)
class Link:
    """Traffic over one connection, bytes per second."""

    name: str
    rate: float


@dataclass(frozen=True)
class Demand:
    """services: by kind.  links: traffic of every kind of connection.  disk: bytes per second of all takes.

    machines: smallest number of machines with the cores of the installation; None when these are unknown.
    """

    services: tuple[ServiceDemand, ...]
    links: tuple[Link, ...]
    disk: float
    machines: int | None

    @property
    def cores(self) -> float:
        return sum(service.number * service.cores for service in self.services)

    @property
    def memory_mb(self) -> float:
        return sum(service.number * service.memory_mb for service in self.services)


def demand(installation: Installation, costs: Costs) -> Demand:
    services = tuple(_services(installation, costs))
    total = sum(service.number * service.cores for service in services)
    machines = None if installation.cores is None else max(1, ceil(total / (USABLE * installation.cores)))
    disk = 0.0
    if installation.log:
        payload = sum(flow.messages * flow.payload for flow in flows(installation, costs))
        disk = installation.rigs * payload * costs.stored * (costs.foxglove_size if installation.foxglove else 1.0)
    return Demand(services, tuple(_links(installation, costs)), disk, machines)


def highest_rate(installation: Installation, costs: Costs, cores: float) -> float:
    """Frames per second at which an installation needs `cores` cores, or one of its loops has no more time.

    0 when even its idle processes need more.
    """
    low, high = 0.0, 1000.0
    for _ in range(40):
        middle = (low + high) / 2
        needed = demand(replace(installation, fps=middle), costs)
        loops = [one.cores for one in needed.services if one.service != "router"]
        fits = needed.cores <= cores and max(loops) <= LOOP_USABLE
        low, high = (middle, high) if fits else (low, middle)
    return low


def flows(installation: Installation, costs: Costs) -> list[Flow]:
    """Messages of one rig."""
    views, fps, side = installation.views, installation.fps, sqrt(installation.megapixels)
    log, pages, tracker = int(installation.log), min(1, installation.pages), int(installation.method == "hybrid")
    services = views + 1 + tracker + pages
    found = [("silhouette", views, fps, costs.silhouette_bytes.at(side), tracker + log + pages, False)]
    if installation.previews:
        found.append(("preview", views, PREVIEW.rate_hz, costs.preview_bytes.at(side), log + pages, False))
    events = fps
    if tracker:
        found.append(("pose", 1, fps, costs.tracker_pose_bytes, log + pages, True))
        found.append(("points", 1, min(fps, SCENE_POINTS.rate_hz), costs.points_bytes, log + pages, False))
        events = fps * (1 + views)
    else:
        found.append(("sighting", views, fps, costs.sighting_bytes, 1 + pages, False))
        found.append(("partial BAP", views, fps, costs.bap_bytes, 1 + pages, False))
        found.append(("assignment", 1, fps, costs.assignment_bytes, views + log + pages, False))
        found.append(("pose", 1, fps, costs.pose_bytes, views + log + pages, True))
        events = fps * 3 * views
    found.append(("health", services, 1.0, costs.health_bytes, 2 + pages, True))
    found.append(("input trace", 1, 1.0, costs.trace_bytes + TRACE_EVENT_BYTES * events, log, False))
    return [
        Flow(name, each, hz, size + costs.overhead_bytes, size, receivers, central)
        for name, each, hz, size, receivers, central in found
    ]


def _services(installation: Installation, costs: Costs) -> Iterator[ServiceDemand]:
    views, fps, rigs, pixels = installation.views, installation.fps, installation.rigs, installation.megapixels
    two_view = installation.method == "two-view"
    idle = costs.process / 1e3
    source = costs.decoding.at(pixels) if installation.decoded else 0.0
    frame = (costs.two_view if two_view else costs.silhouette).at(pixels) + source
    yield ServiceDemand("viewer", installation.cameras, frame * fps / 1e3 + idle, costs.viewer_mb)
    every = flows(installation, costs)
    logged = sum(flow.messages for flow in every) if installation.log else 0.0
    each = costs.logged_foxglove if installation.foxglove else costs.logged
    own = costs.integrator * fps if two_view else costs.timekeeper
    yield ServiceDemand("integrator", rigs, (own + logged * each) / 1e3 + idle, costs.integrator_mb)
    if not two_view:
        yield ServiceDemand("tracker", rigs, costs.tracker.at(views) * fps / 1e3 + idle, costs.tracker_mb)
    if installation.pages:
        page = costs.animator * fps + costs.page * installation.pages
        yield ServiceDemand("animator", rigs, page / 1e3 + idle, costs.animator_mb)
    if installation.routers:
        forwarded = sum(flow.messages * flow.receivers for flow in every) * rigs / installation.routers
        cores = forwarded * costs.forwarded / 1e3 + idle
        number = installation.routers + (installation.routers > 1)
        yield ServiceDemand("router", number, cores, costs.router_mb)


def _links(installation: Installation, costs: Costs) -> Iterator[Link]:
    every, rigs = flows(installation, costs), installation.rigs
    own = [flow for flow in every if flow.name in ("silhouette", "preview", "sighting", "partial BAP")]
    yield Link("camera to network", sum(flow.hz * flow.bytes for flow in own))
    if installation.method == "hybrid":
        yield Link("network to tracker", sum(flow.rate for flow in every if flow.name == "silhouette"))
    if installation.log:
        yield Link("network to log", sum(flow.rate for flow in every))
    if installation.pages:
        yield Link("network to animator", sum(flow.rate for flow in every))
    if installation.routers:
        yield Link("into each router", sum(flow.rate for flow in every) * rigs / installation.routers)
        yield Link("out of each router", sum(flow.rate * flow.receivers for flow in every) * rigs / installation.routers)
    if installation.routers > 1:
        below = rigs / installation.routers
        yield Link("router to root: no reader there", 0.0)
        central = sum(flow.rate for flow in every if flow.central)
        yield Link("router to root: health and poses are read there", central * below)
        yield Link("router to root: everything is read there", sum(flow.rate for flow in every) * below)
        yield Link("root to its readers: health and poses of all rigs", central * rigs)
