"""Ramp: a load increased until it is no longer held, and its limit."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from zenocap.tools.measure.load_plan import MAX_RATE, MAX_RIGS, MAX_VIEWERS, LoadError, Plan, PlanError, checked
from zenocap.tools.measure.measurement import Measurement

RampQuantity = Literal["rate", "viewers", "rigs"]
MOST: dict[RampQuantity, float] = {"rate": MAX_RATE, "viewers": MAX_VIEWERS, "rigs": MAX_RIGS}
BISECTIONS = 3  # between the largest value that held and the smallest that did not


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
    return {"rate": plan.rate, "viewers": plan.viewers, "rigs": plan.rigs}[quantity]


def ramp(
    plan: Plan, quantity: RampQuantity, measure: Callable[[Plan], Measurement], stopped: Callable[[], bool],
    watch: Callable[[Measurement], None],
) -> Ramp:  # fmt: skip
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


def scaled(plan: Plan, quantity: RampQuantity, value: float) -> Plan:
    """The plan with another value of a quantity."""
    if quantity == "rate":
        return replace(plan, rate=value)
    return replace(plan, viewers=round(value)) if quantity == "viewers" else replace(plan, rigs=round(value))


def next_value(quantity: RampQuantity, start: float, tried: Sequence[tuple[float, bool]]) -> float | None:
    """Next value of a ramp after the tried ones (value, held); None when the limit is known well enough.

    Doubles until one does not hold, then bisects between the largest that held and the smallest that did not.
    A value that held above one that did not is ignored: the limit is the smallest that did not.
    """
    if not tried:
        return start
    failed = min((value for value, held in tried if not held), default=math.inf)
    held_below = max((value for value, held in tried if held and value < failed), default=0.0)
    if math.isinf(failed):
        return min(2 * held_below, MOST[quantity]) if held_below < MOST[quantity] else None
    if held_below == 0.0:  # not even the start
        return None
    doublings = sum(1 for value, held in tried if held and value <= held_below and _doubled(value, start))
    bisections = len(tried) - doublings - 1
    middle = math.sqrt(held_below * failed) if quantity == "rate" else float((held_below + failed) // 2)
    middle = round(middle, 1)
    return middle if bisections < BISECTIONS and held_below < middle < failed else None


def _doubled(value: float, start: float) -> bool:
    power = math.log2(value / start)
    return abs(power - round(power)) < 1e-9
