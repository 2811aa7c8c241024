"""Parameters of one load."""

from dataclasses import dataclass
from typing import Literal

from zenocap.common.errors import UserError

Method = Literal["two-view", "hybrid"]
Until = Literal["pose", "silhouette"]
Part = Literal["all", "viewers", "integrators"]
Priority = Literal["low", "normal"]

MAX_VIEWERS, MAX_RIGS, MAX_RATE = 64, 64, 1000.0


class PlanError(UserError):
    """An impossible plan; the text contains the option, its value and the allowed values."""


class LoadError(UserError):
    """A load that cannot be measured; the text is the reason."""


@dataclass(frozen=True)
class Plan:
    """viewers, subscribers: of each rig.  rate: frames per second of each viewer.  size: (width, height) px.

    until: message that completes a frame set: the pose, or every viewer's silhouette (then no pose is computed).
    stand_ins: viewers that publish recorded messages and compute nothing.  name: prefix of the rigs' names.
    seconds: measured time, after `settle_s` seconds of warm-up.  log: takes are written and deleted.
    mesh: peers without a router; else clients of a router.  part: the processes started on this machine.
    subscriber_priority: low as that of a page, or normal as that of the services and of other programs.
    """

    viewers: int = 2
    rigs: int = 1
    rate: float = 30.0
    size: tuple[int, int] = (160, 120)
    method: Method = "two-view"
    until: Until = "pose"
    stand_ins: bool = False
    subscribers: int = 0
    seconds: float = 10.0
    settle_s: float = 3.0
    mesh: bool = False
    log: bool = False
    part: Part = "all"
    name: str = "load"
    subscriber_priority: Priority = "low"

    @property
    def period_s(self) -> float:
        return 1.0 / self.rate

    @property
    def views(self) -> tuple[str, ...]:
        """Ids of the viewers of each rig."""
        return tuple(str(number) for number in range(1, self.viewers + 1))

    @property
    def rig_names(self) -> tuple[str, ...]:
        return tuple(f"{self.name}-{number}" for number in range(1, self.rigs + 1))

    @property
    def has_tracker(self) -> bool:
        return self.method == "hybrid" and self.until == "pose"

    def title(self) -> str:
        what = "stand-ins for viewers" if self.stand_ins else "viewers"
        many = f"{self.rigs} rigs of " if self.rigs > 1 else ""
        more = [", silhouettes only"] if self.until == "silhouette" else [f", {self.method}"]
        priority = " of normal priority" if self.subscriber_priority == "normal" else ""
        more += [f", {self.subscribers} subscribers{priority}"] if self.subscribers else []
        more += [", mesh"] if self.mesh else []
        return f"{many}{self.viewers} {what}, {self.rate:g} frames/s, {self.size[0]}x{self.size[1]}{''.join(more)}"


def checked(plan: Plan) -> Plan:
    """Return the plan if it is possible.  Raises PlanError."""
    for option, most in (("viewers", MAX_VIEWERS), ("rigs", MAX_RIGS), ("rate", MAX_RATE)):
        if (value := getattr(plan, option)) > most:
            raise PlanError(f"--{option} {value:g}: allowed: to {most:g}")
    if plan.method == "two-view" and plan.viewers != 2:
        raise PlanError(
            f"--viewers {plan.viewers}: allowed with --method two-view: 2; more with --method hybrid, or --rigs"
        )
    if plan.method == "two-view" and plan.until == "silhouette":
        raise PlanError("--until silhouette: allowed with --method hybrid")
    if plan.viewers < 2:
        raise PlanError(f"--viewers {plan.viewers}: allowed: 2 to {MAX_VIEWERS}")
    if plan.mesh and plan.part != "all":
        raise PlanError(f"--mesh --part {plan.part}: allowed: with all parts on this machine")
    return plan
