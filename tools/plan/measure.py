"""Costs of this machine, from short loads of `zenocap load`."""

from collections.abc import Callable
from dataclasses import replace
from statistics import mean

from zenocap.tools.load_test.measurement import Measurement
from zenocap.tools.load_test.plan import Plan
from zenocap.tools.plan.calculator import Installation, demand
from zenocap.tools.plan.costs import Costs, Linear
from zenocap.tools.plan.parameters import MEASURED_RATE, MEASURED_S, MEASURED_VIEWS


def plans(size: tuple[int, int]) -> tuple[Plan, Plan]:
    """Two short loads: two-view, and tracker; at a rate that any machine completes."""
    base = Plan(rate=MEASURED_RATE, size=size, seconds=MEASURED_S)
    return base, replace(base, viewers=MEASURED_VIEWS, method="hybrid")


def measured(costs: Costs, size: tuple[int, int], measure: Callable[[Plan], Measurement]) -> Costs:
    """The costs, scaled for this machine.  Decoding, log and page keep theirs.  Raises as `measure` does."""
    two_view, hybrid = (measure(plan) for plan in plans(size))
    viewer, silhouette = _ratio(two_view, "viewer", costs), _ratio(hybrid, "viewer", costs)
    return replace(
        costs,
        two_view=_scaled(costs.two_view, viewer),
        silhouette=_scaled(costs.silhouette, silhouette),
        integrator=costs.integrator * _ratio(two_view, "integrator", costs),
        tracker=_scaled(costs.tracker, _ratio(hybrid, "tracker", costs)),
        forwarded=costs.forwarded * _ratio(two_view, "router", costs),
        process=costs.process * silhouette,
    )


def installation_of(plan: Plan) -> Installation:
    """The installation that a load is: films in memory, no previews, no page, one router."""
    return Installation(
        cameras=plan.viewers * plan.rigs, fps=plan.rate, size=plan.size, method=plan.method, rigs=plan.rigs, decoded=False,
        log=plan.log, foxglove=False, routers=1,
    )  # fmt: skip


def _ratio(point: Measurement, service: str, costs: Costs) -> float:
    """Cores of a service as measured, over those of the plan at the rate that came out."""
    cores = mean(cost.cores for cost in point.costs if cost.key[1] == service)
    rate = point.figures.completed / point.seconds / point.plan.rigs
    installation = installation_of(replace(point.plan, rate=rate))
    return cores / next(one.cores for one in demand(installation, costs).services if one.service == service)


def _scaled(cost: Linear, ratio: float) -> Linear:
    return Linear(cost.base * ratio, cost.each * ratio)
