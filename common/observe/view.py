"""One rig as its services publish it: presence, health, advice on the cameras, clock.  Pure.

Times are of the reader's own monotonic clock, or of the log of a take: its wall clock may be set while it reads.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Literal, TypeVar

from zenocap.common.bus.protocol import Alive, Envelope, Received, RoundTrip
from zenocap.common.camera_advice import marks
from zenocap.common.messages import PROCESS, CameraAdvice, Health
from zenocap.common.observe.losses import lost
from zenocap.common.rig.services import ServiceKey, sort_key, title
from zenocap.common.runtime.clock_offset import ClockFilter, observe

Status = Literal["up", "starting", "silent", "gone", "missing"]
K = TypeVar("K")
V = TypeVar("V")

SILENT_NS = 3_000_000_000  # time without a health message, which is published every second
GONE_NS = SILENT_NS // 3  # without a token, and without a health message for as long
KEPT_RATES = 30  # half a minute; chosen by hand
MOST_OTHERS = 256  # services stored beside those of the rig file; chosen by hand
TROUBLE: tuple[Status, ...] = ("silent", "gone", "missing")


@dataclass(frozen=True)
class ServiceView:
    """One service.  alive: whether its liveliness token exists.  since_ns: time of the token or first health.

    rates: the last ones, oldest first.  lately: losses between the last two health messages.
    past: counts of its processes before the present one.
    """

    alive: bool
    since_ns: int
    health: Health | None = None
    health_ns: int = 0
    rates: tuple[float, ...] = ()
    lately: int = 0
    advice: CameraAdvice | None = None
    past: Mapping[str, int] = field(default_factory=lambda: _nothing())

    def total(self, name: str) -> int:
        """A count over all processes of the service."""
        return self.past.get(name, 0) + (self.health.counts.get(name, 0) if self.health is not None else 0)


def _nothing() -> Mapping[K, V]:
    return MappingProxyType({})


@dataclass(frozen=True)
class RigView:
    """expected: services that the rig must have, which are always stored; of others MOST_OTHERS.

    services: by name and id.  trips: of queries for the integrator's clock.  ignored: events of services not stored.
    """

    rig: str
    expected: tuple[ServiceKey, ...] = ()
    services: Mapping[ServiceKey, ServiceView] = field(default_factory=_nothing)
    trips: ClockFilter = field(default_factory=ClockFilter)
    ignored: int = 0

    @property
    def alive(self) -> frozenset[ServiceKey]:
        """The services whose token exists."""
        return frozenset(key for key, one in self.services.items() if one.alive)

    @property
    def health(self) -> Mapping[ServiceKey, Health]:
        """The last health of each service that has sent one."""
        return {key: one.health for key, one in self.services.items() if one.health is not None}


@dataclass(frozen=True)
class ObservedService:
    """One service as a user reads it.  latency_ms: age of its result, or of its frame, on completion; None without either.

    stage: its slowest stage, with the time.  lost: since its start.  offset_ms, error_ms: of its clock; None if unknown.
    certificate_days: until its certificate expires; None for a rig without certificates.
    advice: faults of a camera's images in few words, empty without any.
    """

    rig: str
    service: str
    id: str
    status: Status
    rate: float = 0.0
    rates: tuple[float, ...] = ()
    latency_ms: float | None = None
    stage: str = ""
    lost: int = 0
    lately: int = 0
    superseded: int = 0
    offset_ms: float | None = None
    error_ms: float | None = None
    memory_mb: float = 0.0
    cores: float = 0.0
    busy: float = 0.0
    phase: str = ""
    words: str = ""
    certificate_days: int | None = None
    advice: str = ""

    @property
    def title(self) -> str:
        return title((self.service, self.id))


def observed(view: RigView, event: Received, at_ns: int) -> RigView:
    """The rig after an event; the same object when nothing has changed.  at_ns: time of receipt."""
    match event:
        case RoundTrip():
            return replace(view, trips=observe(view.trips, event))
        case Alive(service=service, id=id, alive=alive):
            before = view.services.get((service, id))
            if before is None:
                return _stored(view, (service, id), ServiceView(alive, at_ns))
            since_ns = at_ns if alive and not before.alive else before.since_ns
            return _stored(view, (service, id), replace(before, alive=alive, since_ns=since_ns))
        case Envelope(message=Health() as health):
            key = (health.service, health.id)
            return _stored(view, key, with_health(view.services.get(key) or ServiceView(False, at_ns), health, at_ns))
        case Envelope(message=CameraAdvice() as advice):
            key = ("viewer", advice.viewer)
            return _stored(view, key, replace(view.services.get(key) or ServiceView(False, at_ns), advice=advice))
        case _:
            return view


def status(view: RigView, service: ServiceKey, now_ns: int) -> Status:
    """Whether a service runs and reports."""
    known = view.services.get(service)
    if known is None:
        return "missing"
    if not known.alive and now_ns - known.health_ns > GONE_NS:
        return "gone"
    if now_ns - max(known.health_ns, known.since_ns) > SILENT_NS:
        return "silent"
    return "up" if known.health is not None else "starting"


def rows(view: RigView, now_ns: int) -> tuple[ObservedService, ...]:
    """One row for each service, also the missing ones, in the order of the table of services."""
    keys = sorted({*view.services, *view.expected}, key=sort_key)
    return tuple(_row(view, key, status(view, key, now_ns)) for key in keys)


def without(view: RigView, services: Sequence[ServiceKey]) -> RigView:
    """The rig without some services."""
    kept = {key: one for key, one in view.services.items() if key not in services}
    return replace(view, services=MappingProxyType(kept))


def _stored(view: RigView, key: ServiceKey, one: ServiceView) -> RigView:
    others = sum(known not in view.expected for known in view.services)
    if key not in view.services and key not in view.expected and others >= MOST_OTHERS:
        return replace(view, ignored=view.ignored + 1)
    return replace(view, services=MappingProxyType({**view.services, key: one}))


def with_health(one: ServiceView, health: Health, at_ns: int) -> ServiceView:
    """View after a health message."""
    lately = lost(health.counts) - (lost(one.health.counts) if one.health else 0)
    rates = (*one.rates, health.rate)[-KEPT_RATES:]
    past = one.past
    if one.health is not None and _is_restarted(one.health, health):
        past = {name: one.total(name) for name in {*past, *one.health.counts}}
    return replace(
        one, health=health, health_ns=at_ns, rates=rates, lately=max(0, lately) if one.health else 0, past=past
    )  # fmt: skip


def _is_restarted(before: Health, after: Health) -> bool:
    """Whether two healths of one service are of different processes; those of earlier versions have no number of it."""
    processes = [health.counts.get(PROCESS) for health in (before, after)]
    return processes[0] != processes[1] if None not in processes else after.frame <= before.frame


def _row(view: RigView, key: ServiceKey, its_status: Status) -> ObservedService:
    one = view.services.get(key)
    if one is None or one.health is None:
        return ObservedService(view.rig, *key, its_status)
    health = one.health
    ages = [health.stages_ms[stage] for stage in ("result_age", "frame_age") if stage in health.stages_ms]
    steps = {stage: ms for stage, ms in health.stages_ms.items() if stage.startswith("step_")}
    longest = max(steps, key=lambda stage: steps[stage], default=None)
    clock = health.clock_error_ns > 0
    return ObservedService(
        view.rig, *key, its_status, health.rate, one.rates, ages[0] if ages else None,
        f"{longest.removeprefix('step_')} {steps[longest]:.1f}" if longest else "",
        lost(health.counts), one.lately, health.counts.get("dropped_superseded", 0),
        health.clock_offset_ns / 1e6 if clock else None, health.clock_error_ns / 1e6 if clock else None,
        health.memory_bytes / 1e6, health.cores, health.busy, health.phase, health.state,
        health.counts.get("certificate_days"), marks(one.advice) if one.advice else "",
    )  # fmt: skip
