"""The seeded schedule: which faults come after each other, against which service, and for how long.

A schedule is endless and depends on the seed alone; a run takes as much of it as fits into its time.
"""

import random
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace

ROUTER, INTEGRATOR, TRACKER, RECOGNIZER, ANIMATOR = "router", "integrator", "tracker", "recognizer", "animator"
VIEWERS = ("viewer 1", "viewer 2", "viewer 3")
SERVICES = (*VIEWERS, INTEGRATOR, TRACKER, RECOGNIZER, ANIMATOR)
POSE_PATH = frozenset((ROUTER, INTEGRATOR, TRACKER, *VIEWERS))  # without these, or some of them, poses may pause

# Kinds of messages of a peer that does not belong to the rig: see `hostile`.
FLOODS = ("malformed", "strangers", "huge", "skewed", "false orders")
IMPOSTOR = "impostor"
SKEWED_NS = 777_777  # the last digits of the capture time of every copy of "skewed", in its millisecond
MACHINE = "machine"
PAGE_FLOODS = ("connections", "requests", "malformed requests", "never reads")


@dataclass(frozen=True)
class FaultKind:
    """A kind of fault.

    targets: drawn from.  seconds: shortest and longest.  weight: relative frequency; 0: drawn only where it is named.
    """

    name: str
    targets: tuple[str, ...]
    seconds: tuple[float, float]
    weight: float


KINDS = (
    FaultKind("kill", (*SERVICES, ROUTER), (0.0, 0.0), 3.0),
    FaultKind("terminate", SERVICES, (0.0, 0.0), 2.0),  # SIGTERM of another program, after which a service ends in order
    FaultKind("stop", (*SERVICES, ROUTER), (0.5, 6.0), 3.0),
    FaultKind("cut", SERVICES, (0.5, 6.0), 2.0),  # its packets vanish
    FaultKind("disconnect", SERVICES, (0.5, 6.0), 1.0),  # its connections are closed, and refused
    FaultKind("clock", (MACHINE, *SERVICES), (1.0, 5.0), 1.0),  # set by seconds, and then right again
    FaultKind("flood", FLOODS, (1.0, 5.0), 3.0),
    FaultKind("forgery", (IMPOSTOR,), (1.0, 5.0), 0.0),  # an open network does not protect against it: docs/machines.md
    FaultKind("page", PAGE_FLOODS, (1.0, 5.0), 2.0),
    FaultKind("full disk", ("",), (1.0, 5.0), 1.0),
    FaultKind("recordings", ("deleted", "moved"), (0.0, 0.0), 1.0),
    FaultKind("requests", ("record and stop",), (1.0, 5.0), 1.0),  # not "measure": the person then has to take the T-pose
)
OF_SERVICES = ("kill", "terminate", "stop", "cut", "disconnect", "clock")
PAUSE_S = (0.5, 3.0)  # from the recovery to the next fault
DOUBLE = 0.25  # probability that another fault begins together with a fault


@dataclass(frozen=True)
class Fault:
    """One fault.  seconds: its length; 0 for one that happens at once."""

    kind: str
    target: str
    seconds: float

    @property
    def name(self) -> str:
        length = f" for {self.seconds:.1f} s" if self.seconds else ""
        return f"{self.kind} {self.target}".strip() + length

    @property
    def hits(self) -> frozenset[str]:
        """Services that it hits directly; for all others nothing may change but what they receive."""
        if self.target in (*SERVICES, ROUTER):
            return frozenset((self.target,))
        return frozenset((INTEGRATOR,)) if self.kind in ("full disk", "recordings") else frozenset()

    @property
    def disturbs_poses(self) -> bool:
        """Whether poses may pause while it lasts."""
        false_content = self.target in (IMPOSTOR, "skewed", "huge", MACHINE)
        return bool(self.hits & POSE_PATH and self.kind in OF_SERVICES) or false_content


@dataclass(frozen=True)
class Round:
    """One or two faults that begin together, and the pause before them (s)."""

    pause_s: float
    faults: tuple[Fault, ...]

    @property
    def name(self) -> str:
        return " + ".join(fault.name for fault in self.faults)


def schedule(seed: int, kinds: Collection[str] = ()) -> Iterator[Round]:
    """Endless rounds; equal seeds give equal ones.  kinds: the only kinds, or targets, that are drawn; all by default."""
    rng = random.Random(f"chaos {seed}")
    chosen = [_only(kind, kinds) for kind in KINDS]
    chosen = [kind for kind in chosen if kind.targets]
    while True:
        pause_s = rng.uniform(*PAUSE_S)
        faults = [_drawn(rng, chosen)]
        if rng.random() < DOUBLE:
            other = _drawn(rng, chosen)
            if _compatible(faults[0], other):
                faults.append(other)
        yield Round(pause_s, tuple(faults))


def _only(kind: FaultKind, names: Collection[str]) -> FaultKind:
    """A kind with those of its targets that are named, or all if it is named itself; without names, one with a weight."""
    if not names and not kind.weight:
        return replace(kind, targets=())
    if not names or kind.name in names:
        return replace(kind, weight=kind.weight or 1.0)
    return replace(kind, targets=tuple(target for target in kind.targets if target in names), weight=kind.weight or 1.0)


def _drawn(rng: random.Random, kinds: list[FaultKind]) -> Fault:
    (kind,) = rng.choices(kinds, [kind.weight for kind in kinds])
    return Fault(kind.name, rng.choice(kind.targets), round(rng.uniform(*kind.seconds), 2))


def _compatible(first: Fault, second: Fault) -> bool:
    """Whether two faults can be told apart: not of the same kind, and not against the same service."""
    return first.kind != second.kind and not first.hits & second.hits
