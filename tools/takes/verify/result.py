"""Result of a verification: counts by key, the first difference field by field, and the report."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from math import isclose

import msgspec

from zenocap.common import codec
from zenocap.common.bus.protocol import Envelope
from zenocap.common.messages import Message
from zenocap.common.rig.services import ServiceKey
from zenocap.common.runtime.service_info import versions

MAX_FIELDS = 20  # named per difference
ABSENT = "nothing"


@dataclass(frozen=True)
class Difference:
    """A recomputed message unlike the recorded one.  fields: "path: logged ..., recomputed ...", at most MAX_FIELDS."""

    key: str
    frame: int
    captured_ns: int
    fields: tuple[str, ...]


@dataclass(frozen=True)
class Reason:
    """Reason that messages could not be checked.  service: of the messages; None for all services."""

    service: ServiceKey | None
    text: str

    def __str__(self) -> str:
        return self.text if self.service is None else f"{self.service[0]} {self.service[1]}: {self.text}"


@dataclass
class Verification:
    """Derived messages by key, compared with the recomputed ones.

    equal, different: in the take and recomputed.  unlogged: recomputed, but not in the take.  lost: recomputed, and lost on
    the way to the log, as its counts say.  unchecked: in the take, but not recomputed, for the `reasons`.  close: number of
    equal ones that are equal within the tolerance only.  first: difference that is first in the order of the log.
    duration_s: of the take.  versions: of the software that recorded it.
    """

    equal: Counter[str] = field(default_factory=Counter)
    different: Counter[str] = field(default_factory=Counter)
    unlogged: Counter[str] = field(default_factory=Counter)
    lost: Counter[str] = field(default_factory=Counter)
    unchecked: Counter[str] = field(default_factory=Counter)
    reasons: list[Reason] = field(default_factory=list)
    close: int = 0
    first: Difference | None = None
    duration_s: float = 0.0
    versions: dict[str, str] = field(default_factory=dict)

    def compare(self, logged: Envelope, recomputed: bytes, tolerance: float) -> Difference | None:
        """Count a recorded message as equal to the recomputed one, or as different; return the difference."""
        if logged.data == recomputed:
            self.equal[logged.key] += 1
            return None
        found = difference(logged.key, logged.message, codec.decode(recomputed, logged.topic.message), tolerance)
        if found is None and tolerance:
            self.equal[logged.key] += 1
            self.close += 1
            return None
        self.different[logged.key] += 1
        fields = ("the same fields in other bytes",)
        return found or Difference(logged.key, logged.message.frame, logged.message.captured_ns, fields)

    @property
    def checked(self) -> int:
        return self.equal.total() + self.different.total()

    @property
    def failed(self) -> bool:
        """Whether a message differs, or is missing from the take."""
        return bool(self.different or self.unlogged)

    @property
    def complete(self) -> bool:
        """Whether every derived message could be recomputed."""
        return not (self.unchecked or self.reasons)


def difference(key: str, logged: Message, recomputed: Message, tolerance: float = 0.0) -> Difference | None:
    """Return None when every field is equal; numbers may differ by `tolerance`, relative or absolute (the larger)."""
    found = tuple(_differing("", msgspec.to_builtins(logged), msgspec.to_builtins(recomputed), tolerance))
    if not found:
        return None
    more = (f"... and {len(found) - MAX_FIELDS} more fields",) if len(found) > MAX_FIELDS else ()
    return Difference(key, logged.frame, logged.captured_ns, (*found[:MAX_FIELDS], *more))


def report(found: Verification, elapsed_s: float) -> list[str]:
    """Lines of text: a table by key, the first difference, and messages that could not be checked."""
    keys = sorted({*found.equal, *found.different, *found.unlogged, *found.unchecked})
    width = max(map(len, keys))
    lines = [f"{'recomputed messages':{width}} {'equal':>8} {'differ':>8} {'not logged':>10} {'unchecked':>10}"]
    counts: tuple[Counter[str], ...] = (found.equal, found.different, found.unlogged, found.unchecked)
    for key in keys:
        equal, different, unlogged, unchecked = (count[key] for count in counts)
        lines.append(f"{key:{width}} {equal:8d} {different:8d} {unlogged:10d} {unchecked:10d}")
    equal, different, unlogged, unchecked = (count.total() for count in counts)
    close = f", {found.close} of them within the tolerance" if found.close else ""
    times = f", {found.duration_s / elapsed_s:.1f} times real time" if elapsed_s > 0 else ""
    lines.append(f"{found.checked} derived messages recomputed in {elapsed_s:.1f} s{times}: {equal} equal{close}")
    if found.first:
        lines.append(
            f"first difference: {found.first.key}, frame {found.first.frame}, captured at {found.first.captured_ns} ns"
        )
        lines += [f"  {field}" for field in found.first.fields]
        lines += [
            f"  recorded with {name} {was}, verified with {now}" for name, (was, now) in other_versions(found).items()
        ]
    if found.failed:
        lines.append(f"NOT equal: {different} differ, {unlogged} are missing from the take")
    if not found.complete:
        lines.append(f"not checked: {unchecked} messages")
        lines += [f"  {reason}" for reason in dict.fromkeys(found.reasons)]
    return lines


def data_of(found: Verification, elapsed_s: float) -> dict[str, object]:
    """The content of the report for JSON."""
    counts = {name: dict(getattr(found, name)) for name in ("equal", "different", "unlogged", "lost", "unchecked")}
    values = asdict(found) | counts | {"reasons": [str(reason) for reason in found.reasons]}
    return values | {"elapsed_s": elapsed_s, "differing_versions": other_versions(found)}


def other_versions(found: Verification) -> dict[str, tuple[str, str]]:
    """Version of the take and version here, by name, where the two differ."""
    here = versions()
    return {name: (was, here[name]) for name, was in found.versions.items() if here.get(name, was) != was}


def _differing(path: str, logged: object, recomputed: object, tolerance: float) -> Iterator[str]:
    match logged, recomputed:
        case dict(), dict():
            for name in dict.fromkeys([*logged, *recomputed]):
                inner = f"{path}.{name}" if path else str(name)
                yield from _differing(inner, logged.get(name, ABSENT), recomputed.get(name, ABSENT), tolerance)
        case list() | tuple(), list() | tuple() if len(logged) == len(recomputed):
            for k, (one, other) in enumerate(zip(logged, recomputed, strict=True)):
                yield from _differing(f"{path}[{k}]", one, other, tolerance)
        case float(), float() if tolerance and isclose(logged, recomputed, rel_tol=tolerance, abs_tol=tolerance):
            return
        case _ if logged != recomputed:
            yield f"{path}: logged {logged!r}, recomputed {recomputed!r}"
