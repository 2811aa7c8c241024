"""State of every service of every rig, from the messages and their times of receipt.  Pure."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Literal

from zenocap.common.bus.protocol import Alive, Envelope
from zenocap.common.camera_advice import marks
from zenocap.common.messages import CameraAdvice, Health
from zenocap.common.observe.losses import lost
from zenocap.common.rig.services import ServiceKey, sort_key, title

Status = Literal["up", "starting", "silent", "gone", "missing"]

SILENT_NS = 3_000_000_000  # time without a health message, which is published every second
KEPT_RATES = 30
MAX_SERVICES = 256  # stored of each rig beside those of its rig file; chosen by hand
TROUBLE: tuple[Status, ...] = ("silent", "gone", "missing")


@dataclass(frozen=True)
class ServiceState:
    """State of one service.  alive: whether its liveliness token exists.  since_ns: time of the token or first health.

    rates: the last ones, oldest first.  lately: losses between the last two health messages.
    """

    alive: bool
    since_ns: int
    health: Health | None = None
    health_ns: int = 0
    rates: tuple[float, ...] = ()
    lately: int = 0
    advice: CameraAdvice | None = None


@dataclass(frozen=True)
class Row:
    """One line of the table.  latency_ms: age of its result, or of its frame, on completion; None without either.

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


@dataclass(frozen=True)
class Network:
    """expected: services that a rig must have, by rig.  known: observed state, by rig and service."""

    expected: Mapping[str, Sequence[ServiceKey]] = field(default_factory=lambda: MappingProxyType({}))
    known: Mapping[tuple[str, str, str], ServiceState] = field(default_factory=lambda: MappingProxyType({}))

    def updated(self, rig: str, event: Envelope | Alive) -> "Network":
        """The network after one event of a rig."""
        match event:
            case Alive(service=service, id=id, alive=alive, received_ns=ns):
                before = self.known.get((rig, service, id))
                if before is not None:
                    state = replace(before, alive=alive, since_ns=ns if alive and not before.alive else before.since_ns)
                else:
                    state = ServiceState(alive, ns)
                return self._with((rig, service, id), state)
            case Envelope(message=Health() as health, received_ns=ns):
                key = (rig, health.service, health.id)
                return self._with(key, _with_health(self.known.get(key) or ServiceState(False, ns), health, ns))
            case Envelope(message=CameraAdvice() as advice, received_ns=ns):
                key = (rig, "viewer", advice.viewer)
                return self._with(key, replace(self.known.get(key) or ServiceState(False, ns), advice=advice))
            case _:
                return self

    def _with(self, key: tuple[str, str, str], state: ServiceState) -> "Network":
        rig, service, id = key
        expected = self.expected.get(rig, ())
        others = (known for known in self.known if known[0] == rig and known[1:] not in expected)
        if key not in self.known and (service, id) not in expected and sum(1 for _ in others) >= MAX_SERVICES:
            return self
        return replace(self, known=MappingProxyType({**self.known, key: state}))

    def rows(self, now_ns: int) -> Iterator[Row]:
        """Rows by rig and service, including missing services."""
        missing = {(rig, name, id) for rig, services in self.expected.items() for name, id in services}
        for rig, service, id in sorted({*self.known, *missing}, key=_order):
            known = self.known.get((rig, service, id))
            yield Row(rig, service, id, "missing") if known is None else _row(rig, service, id, known, now_ns)


def _with_health(state: ServiceState, health: Health, ns: int) -> ServiceState:
    """State after a health message.  A count that decreased means that the service was restarted."""
    lately = lost(health.counts) - (lost(state.health.counts) if state.health else 0)
    rates = (*state.rates, health.rate)[-KEPT_RATES:]
    return replace(state, health=health, health_ns=ns, rates=rates, lately=max(0, lately) if state.health else 0)


def _row(rig: str, service: str, id: str, state: ServiceState, now_ns: int) -> Row:
    health = state.health
    status = _status(state, now_ns)
    if health is None:
        return Row(rig, service, id, status)
    ages = [health.stages_ms[stage] for stage in ("result_age", "frame_age") if stage in health.stages_ms]
    steps = {stage: ms for stage, ms in health.stages_ms.items() if stage.startswith("step_")}
    longest = max(steps, key=lambda stage: steps[stage], default=None)
    clock = health.clock_error_ns > 0
    return Row(
        rig, service, id, status, health.rate, state.rates, ages[0] if ages else None,
        f"{longest.removeprefix('step_')} {steps[longest]:.1f}" if longest else "",
        lost(health.counts), state.lately, health.counts.get("dropped_superseded", 0),
        health.clock_offset_ns / 1e6 if clock else None, health.clock_error_ns / 1e6 if clock else None,
        health.memory_bytes / 1e6, health.cores, health.busy, health.phase, health.state,
        health.counts.get("certificate_days"), marks(state.advice) if state.advice else "",
    )  # fmt: skip


def _status(state: ServiceState, now_ns: int) -> Status:
    last_ns = max(state.health_ns, state.since_ns)
    if not state.alive and now_ns - state.health_ns > SILENT_NS / 3:
        return "gone"
    if now_ns - last_ns > SILENT_NS:
        return "silent"
    return "up" if state.health is not None else "starting"


def _order(key: tuple[str, str, str]) -> tuple[str, tuple[int, str, int, str]]:
    rig, *service = key
    return rig, sort_key((service[0], service[1]))
