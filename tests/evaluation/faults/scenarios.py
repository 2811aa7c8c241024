"""The faults, one row each: what happens, to whom, for how long."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from tests.evaluation.faults.stage import INTEGRATOR, ROUTER, Stage

VIEWER = "viewer-2"
Act = Callable[[Stage], None]


def nothing(_: Stage) -> None:
    """No act."""


@dataclass(frozen=True)
class Fault:
    """concerned: ids of the viewers that cannot take part meanwhile.  method: of the rig that it happens to.

    long: only in the long form.  after_s: how long is looked at what follows.  tidy: what is put right after that.
    settle: wait for poses of all viewers after `begin` before the fault counts as begun, as for clocks.
    """

    name: str
    seconds: float
    begin: Act
    end: Act = nothing
    concerned: tuple[str, ...] = ()
    method: str = "two-view"
    long: bool = True
    after_s: float = 8.0
    tidy: Act = nothing
    settle: bool = False


def cut(
    name: str, label: str, seconds: float, concerned: tuple[str, ...], *, long: bool = True, method: str = "two-view"
) -> Fault:
    return Fault(
        f"link of {label} cut for {seconds:g} s", seconds, lambda stage: stage.network.cut(name),
        lambda stage: stage.network.restore(name), concerned, method, long,
    )  # fmt: skip


def loss(name: str, label: str, share: float, *, long: bool = True) -> Fault:
    return Fault(
        f"{share:.0%} of the packets of {label} lost for 10 s", 10.0, lambda stage: stage.network.lose(name, share),
        lambda stage: stage.network.lose(name, 0.0), ("2",) if name == VIEWER else ("1", "2"), long=long,
    )  # fmt: skip


def killed(
    name: str, label: str, concerned: tuple[str, ...], *, long: bool = True, method: str = "two-view", after_s: float = 15.0
) -> Fault:
    return Fault(
        f"{label} killed, started again after 2 s", 2.0, lambda stage: stage.kill(name), lambda stage: stage.start(name),
        concerned, method, long, after_s=after_s,
    )  # fmt: skip


def frozen(name: str, label: str, seconds: float, concerned: tuple[str, ...], *, long: bool = True) -> Fault:
    return Fault(
        f"{label} frozen for {seconds:g} s", seconds, lambda stage: stage.freeze(name), lambda stage: stage.thaw(name),
        concerned, long=long,
    )  # fmt: skip


def clock(label: str, offset_s: float, drift: float) -> Fault:
    def begin(stage: Stage) -> None:
        stage.kill(VIEWER)
        wrong = [
            "-m",
            "tests.evaluation.faults.skewed_viewer",
            str(stage.rig),
            "2",
            stage.endpoint,
            str(offset_s),
            str(drift),
        ]
        stage.start(VIEWER, wrong)

    def tidy(stage: Stage) -> None:
        stage.kill(VIEWER)
        stage.start(VIEWER)

    return Fault(f"clock of viewer 2 {label}", 20.0, begin, concerned=("2",), settle=True, after_s=2.0, tidy=tidy)


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
    killed("recognizer", "the recogniser", ()),
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
