"""What is known of every service of every rig: pure values, made from what came and when."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Literal

from common.bus.protocol import Alive, Envelope
from common.messages import Health

Status = Literal["up", "starting", "silent", "gone", "missing"]
Service = tuple[str, str]  # name and id

SILENT_NS = 3_000_000_000  # without a health, which comes every second
KEPT_RATES = 30
LOSSES = (
    "dropped_frames", "dropped_instants", "dropped_queue_full", "rejected_invalid", "rejected_names", "rejected_size",
    "step_errors", "unsendable", "log_lost",
)  # fmt: skip
TROUBLE: tuple[Status, ...] = ("silent", "gone", "missing")


@dataclass(frozen=True)
class Known:
    """Of one service.  alive: whether its token is there.  since_ns: of the token, or of the first health.

    rates: the last ones, oldest first.  lately: losses between the last two healths.
    """

    alive: bool
    since_ns: int
    health: Health | None = None
    heard_ns: int = 0
    rates: tuple[float, ...] = ()
    lately: int = 0


@dataclass(frozen=True)
class Row:
    """One line of the table.  latency_ms: age of its result, or of its frame, when it was done; None for neither.

    stage: what takes it longest, and how long.  lost: since its start.  offset_ms, error_ms: of its clock; None unknown.
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
    words: str = ""

    @property
    def title(self) -> str:
        return self.service if self.id == "main" else f"{self.service} {self.id}"


@dataclass(frozen=True)
class Network:
    """expected: services that a rig must have, by rig.  known: what was heard, by rig and service."""

    expected: Mapping[str, Sequence[Service]] = field(default_factory=lambda: MappingProxyType({}))
    known: Mapping[tuple[str, str, str], Known] = field(default_factory=lambda: MappingProxyType({}))

    def heard(self, rig: str, event: Envelope | Alive) -> "Network":
        """The network after one event of a rig."""
        match event:
            case Alive(service=service, id=id, alive=alive, received_ns=ns):
                before = self.known.get((rig, service, id))
                if before is not None:
                    known = replace(before, alive=alive, since_ns=ns if alive and not before.alive else before.since_ns)
                else:
                    known = Known(alive, ns)
                return self._with((rig, service, id), known)
            case Envelope(message=Health() as health, received_ns=ns):
                who = (rig, health.service, health.id)
                return self._with(who, _told(self.known.get(who) or Known(False, ns), health, ns))
            case _:
                return self

    def _with(self, who: tuple[str, str, str], known: Known) -> "Network":
        return replace(self, known=MappingProxyType({**self.known, who: known}))

    def rows(self, now_ns: int) -> Iterator[Row]:
        """By rig and service, those that are missing among them."""
        missing = {(rig, name, id) for rig, services in self.expected.items() for name, id in services}
        for rig, service, id in sorted({*self.known, *missing}, key=_order):
            known = self.known.get((rig, service, id))
            yield Row(rig, service, id, "missing") if known is None else _row(rig, service, id, known, now_ns)


def _told(known: Known, health: Health, ns: int) -> Known:
    """A count that fell means that the service began anew."""
    lately = _lost(health) - (_lost(known.health) if known.health else 0)
    rates = (*known.rates, health.rate)[-KEPT_RATES:]
    return replace(known, health=health, heard_ns=ns, rates=rates, lately=max(0, lately) if known.health else 0)


def _row(rig: str, service: str, id: str, known: Known, now_ns: int) -> Row:
    health = known.health
    status = _status(known, now_ns)
    if health is None:
        return Row(rig, service, id, status)
    ages = [health.stages_ms[stage] for stage in ("result_age", "frame_age") if stage in health.stages_ms]
    steps = {stage: ms for stage, ms in health.stages_ms.items() if stage.startswith("step_")}
    longest = max(steps, key=lambda stage: steps[stage], default=None)
    clock = health.clock_error_ns > 0
    return Row(
        rig, service, id, status, health.rate, known.rates, ages[0] if ages else None,
        f"{longest.removeprefix('step_')} {steps[longest]:.1f}" if longest else "",
        _lost(health), known.lately, health.counts.get("dropped_superseded", 0),
        health.clock_offset_ns / 1e6 if clock else None, health.clock_error_ns / 1e6 if clock else None,
        health.memory_bytes / 1e6, health.cores, health.busy, health.state,
    )  # fmt: skip


def _status(known: Known, now_ns: int) -> Status:
    last_ns = max(known.heard_ns, known.since_ns)
    if not known.alive and now_ns - known.heard_ns > SILENT_NS / 3:
        return "gone"
    if now_ns - last_ns > SILENT_NS:
        return "silent"
    return "up" if known.health is not None else "starting"


def _lost(health: Health) -> int:
    return sum(health.counts.get(name, 0) for name in LOSSES)


def _order(who: tuple[str, str, str]) -> tuple[str, int, str, int, str]:
    rig, service, id = who
    first = ("viewer", "tracker", "integrator", "recognizer", "animator")
    number = first.index(service) if service in first else len(first)
    return rig, number, service, int(id) if id.isdecimal() else 0, id
