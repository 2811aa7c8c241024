"""Growing a load until something gives."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from services.load.plan import Grown, LoadError, Plan, PlanError, checked, grown, next_value
from services.load.point import Point


@dataclass(frozen=True)
class Ramp:
    """points: in the order of trying.  failure: why it ended without a measurement, None if it did not."""

    what: Grown
    points: tuple[Point, ...]
    failure: str | None = None

    @property
    def largest_held(self) -> Point | None:
        """The largest below all that did not hold."""
        failed = [value_of(point.plan, self.what) for point in self.points if not point.held]
        held = [p for p in self.points if p.held and all(value_of(p.plan, self.what) < value for value in failed)]
        return max(held, key=lambda point: value_of(point.plan, self.what), default=None)

    @property
    def first_that_gave(self) -> Point | None:
        gave = [point for point in self.points if not point.held]
        return min(gave, key=lambda point: value_of(point.plan, self.what), default=None)


def value_of(plan: Plan, what: Grown) -> float:
    match what:
        case "rate":
            return plan.rate
        case "viewers":
            return plan.viewers
        case "rigs":
            return plan.rigs


def ramp(
    plan: Plan, what: Grown, measure: Callable[[Plan], Point], stopped: Callable[[], bool], watch: Callable[[Point], None]
) -> Ramp:
    """Measure `plan` with more and more of `what`.  watch: sees every point.  Raises PlanError for the first one."""
    points: list[Point] = []
    tried: list[tuple[float, bool]] = []
    value = next_value(what, value_of(plan, what), tried)
    failure = None
    while value is not None and not stopped():
        try:
            point = measure(checked(grown(plan, what, value)))
        except PlanError:
            if not points:
                raise
            break  # larger than a plan can be
        except LoadError as error:
            if not points:
                raise
            failure = f"{what} {value:g}: {error}"
            break
        if stopped() and point.seconds < plan.seconds / 2:
            break  # cut short: it says nothing of this value
        points.append(point)
        tried.append((value, point.held))
        watch(point)
        value = next_value(what, value_of(plan, what), tried)
    return Ramp(what, tuple(points), failure)


def in_words(ramp: Ramp) -> Sequence[str]:
    """What came of it, a line each."""
    held, gave = ramp.largest_held, ramp.first_that_gave
    lines = []
    if held is None:
        lines.append("nothing held: not even the first load came whole and within a frame period")
    else:
        p99 = held.figures.latency_ms["p99"]
        cores = held.used.own
        lines.append(f"held: {held.plan.title()}: nothing lost, p99 {p99:.1f} ms, {cores:.2f} cores of the load's own")
    if gave is not None:
        lines.append(f"gave: {gave.plan.title()}: {gave.bottleneck}")
    if ramp.failure:
        lines.append(f"ended: {ramp.failure}")
    return lines
