"""Table of the faults: kind, affected hosts, duration."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from benchmarks.faults.running_rig import INTEGRATOR, ROUTER, RunningRig

VIEWER = "viewer-2"
Action = Callable[[RunningRig], None]


def no_action(_: RunningRig) -> None:
    """Do nothing."""


@dataclass(frozen=True)
class Fault:
    """One fault.  affected: ids of the viewers that cannot contribute during the fault.  method: of the affected rig.

    long: only in the long form.  after_s: shortest observation after the fault.  repair: action after that.
    settle: the fault begins when poses of all viewers arrive after `begin`, as for clocks.
    """

    name: str
    seconds: float
    begin: Action
    end: Action = no_action
    affected: tuple[str, ...] = ()
    method: str = "two-view"
    long: bool = True
    after_s: float = 8.0
    repair: Action = no_action
    settle: bool = False


def cut(
    name: str, label: str, seconds: float, affected: tuple[str, ...], *, long: bool = True, method: str = "two-view"
) -> Fault:
    return Fault(
        f"link of {label} cut for {seconds:g} s", seconds, lambda rig: rig.network.cut(name),
        lambda rig: rig.network.restore(name), affected, method, long,
    )  # fmt: skip


def loss(name: str, label: str, share: float, *, long: bool = True) -> Fault:
    return Fault(
        f"{share:.0%} of the packets of {label} lost for 10 s", 10.0, lambda rig: rig.network.lose(name, share),
        lambda rig: rig.network.lose(name, 0.0), ("2",) if name == VIEWER else ("1", "2"), long=long,
    )  # fmt: skip


def killed(
    name: str, label: str, affected: tuple[str, ...], *, long: bool = True, method: str = "two-view", after_s: float = 15.0
) -> Fault:
    return Fault(
        f"{label} killed, started again after 2 s", 2.0, lambda rig: rig.kill(name), lambda rig: rig.start(name),
        affected, method, long, after_s=after_s,
    )  # fmt: skip


def frozen(name: str, label: str, seconds: float, affected: tuple[str, ...], *, long: bool = True) -> Fault:
    return Fault(
        f"{label} frozen for {seconds:g} s", seconds, lambda rig: rig.freeze(name), lambda rig: rig.thaw(name),
        affected, long=long,
    )  # fmt: skip


def clock(label: str, offset_s: float, drift: float) -> Fault:
    def begin(rig: RunningRig) -> None:
        rig.kill(VIEWER)
        wrong = [
            "-m",
            "benchmarks.faults.skewed_viewer",
            str(rig.file),
            "2",
            rig.endpoint,
            str(offset_s),
            str(drift),
        ]
        rig.start(VIEWER, wrong)

    def repair(rig: RunningRig) -> None:
        rig.kill(VIEWER)
        rig.start(VIEWER)

    return Fault(f"clock of viewer 2 {label}", 20.0, begin, affected=("2",), settle=True, after_s=2.0, repair=repair)


ALL = ("1", "2")
FAULTS: Sequence[Fault] = (
    cut(VIEWER, "viewer 2", 1.0, ("2",)),
    cut(VIEWER, "viewer 2", 4.0, ("2",), long=False),
    cut(VIEWER, "viewer 2", 15.0, ("2",)),
    cut(ROUTER, "the router", 1.0, ALL),
    cut(ROUTER, "the router", 4.0, ALL),
    cut(ROUTER, "the router", 15.0, ALL),
    cut(INTEGRATOR, "the integrator", 1.0, ()),
    cut(INTEGRATOR, "the integrator", 4.0, ()),
    cut(INTEGRATOR, "the integrator", 15.0, ()),
    loss(VIEWER, "viewer 2", 0.05),
    loss(VIEWER, "viewer 2", 0.30),
    loss(ROUTER, "the router", 0.05),
    loss(ROUTER, "the router", 0.30),
    killed(VIEWER, "viewer 2", ("2",)),
    frozen(VIEWER, "viewer 2", 1.0, ("2",)),
    frozen(VIEWER, "viewer 2", 5.0, ("2",)),
    killed(INTEGRATOR, "the integrator", (), long=False),
    frozen(INTEGRATOR, "the integrator", 5.0, ()),
    killed(ROUTER, "the router", ALL),
    frozen(ROUTER, "the router", 5.0, ALL),
    killed("recognizer", "the recognizer", ()),
    killed("animator", "the animator", ()),
    frozen("animator", "the animator", 5.0, ()),
    clock("0.5 s ahead", 0.5, 0.0),
    clock("0.5 s behind, gaining 0.1 ms/s", -0.5, 1e-4),
    clock("0.5 s behind, gaining 1 ms/s", -0.5, 1e-3),
    cut("viewer-3", "viewer 3 of three", 4.0, ("3",), method="hybrid"),
    killed("viewer-3", "viewer 3 of three", ("3",), method="hybrid"),
    killed("tracker", "the tracker", (), method="hybrid", after_s=30.0),
    killed(INTEGRATOR, "the integrator of three views", (), method="hybrid"),
)
