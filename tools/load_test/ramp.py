"""Increase a load until it is no longer held, and find the limit."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from zenocap.tools.load_test.measurement import Measurement
from zenocap.tools.load_test.plan import LoadError, Plan, PlanError, RampQuantity, checked, next_value, scaled


@dataclass(frozen=True)
class Ramp:
    """points: measurements in order.  failure: why it ended early, None if it did not."""

    quantity: RampQuantity
    points: tuple[Measurement, ...]
    failure: str | None = None

    @property
    def largest_held(self) -> Measurement | None:
        """The largest load below all that did not hold."""
        failed = [value_of(point.plan, self.quantity) for point in self.points if not point.held]
        held = [p for p in self.points if p.held and all(value_of(p.plan, self.quantity) < value for value in failed)]
        return max(held, key=lambda point: value_of(point.plan, self.quantity), default=None)

    @property
    def smallest_failed(self) -> Measurement | None:
        failed = [point for point in self.points if not point.held]
        return min(failed, key=lambda point: value_of(point.plan, self.quantity), default=None)


def value_of(plan: Plan, quantity: RampQuantity) -> float:
    match quantity:
        case "rate":
            return plan.rate
        case "viewers":
            return plan.viewers
        case "rigs":
            return plan.rigs


def ramp(
    plan: Plan,
    quantity: RampQuantity,
    measure: Callable[[Plan], Measurement],
    stopped: Callable[[], bool],
    watch: Callable[[Measurement], None],
) -> Ramp:
    """Measure `plan` with increasing values of a quantity.  watch: gets every measurement.

    Raises PlanError for the first.
    """
    points: list[Measurement] = []
    tried: list[tuple[float, bool]] = []
    value = next_value(quantity, value_of(plan, quantity), tried)
    failure = None
    while value is not None and not stopped():
        try:
            point = measure(checked(scaled(plan, quantity, value)))
        except PlanError:
            if not points:
                raise
            break  # larger than allowed
        except LoadError as error:
            if not points:
                raise
            failure = f"{quantity} {value:g}: {error}"
            break
        if stopped() and point.seconds < plan.seconds / 2:
            break  # interrupted: no result for this value
        points.append(point)
        tried.append((value, point.held))
        watch(point)
        value = next_value(quantity, value_of(plan, quantity), tried)
    return Ramp(quantity, tuple(points), failure)


def ramp_lines(ramp: Ramp) -> Sequence[str]:
    """Results as lines of text."""
    held, failed = ramp.largest_held, ramp.smallest_failed
    lines = []
    if held is None:
        lines.append("not held: even the first load lost frame sets or exceeded a frame period")
    else:
        p99 = held.figures.latency_ms["p99"]
        cores = held.used.own
        lines.append(f"held: {held.plan.title()}: nothing lost, p99 {p99:.1f} ms, {cores:.2f} cores used by the load")
    if failed is not None:
        lines.append(f"not held: {failed.plan.title()}: {failed.bottleneck}")
    if ramp.failure:
        lines.append(f"ended: {ramp.failure}")
    return lines
