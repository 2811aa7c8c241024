"""Plan of an installation as plain text; its costs from short loads on this machine."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import ceil, inf
from statistics import mean
from typing import TYPE_CHECKING

from zenocap.tools.measure.installation import Demand, Installation, demand, highest_rate
from zenocap.tools.measure.load_plan import Plan
from zenocap.tools.measure.unit_costs import LOOP_USABLE, USABLE, Costs, Linear

if TYPE_CHECKING:  # a measurement needs psutil, a plan does not
    from zenocap.tools.measure.measurement import Measurement

HOUR_S, MB, GB = 3600, 1e6, 1e9
GIGABIT = 1e9 / 8  # bytes per second of a usual network
MEASURED_RATE, MEASURED_S, MEASURED_VIEWS = 15.0, 8.0, 4  # frames/s, seconds and views of the loads of --measure; by hand


def lines_of(installation: Installation, costs: Costs) -> Iterator[str]:
    """Yield the lines: services, machines, links, disk."""
    found = demand(installation, costs)
    width, height = installation.size
    rigs = f"{installation.rigs} rigs of {installation.views}" if installation.rigs > 1 else f"{installation.cameras}"
    yield f"{rigs} cameras, {width}x{height}, {installation.fps:g} frames/s, {installation.method}"
    yield ""
    yield f"{'service':12}{'number':>8}{'cores each':>12}{'cores':>8}{'memory MB':>12}"
    for one in found.services:
        cores, memory_mb = one.number * one.cores, one.number * one.memory_mb
        yield f"{one.service:12}{one.number:8d}{one.cores:12.2f}{cores:8.1f}{memory_mb:12.0f}"
    yield f"{'in all':12}{sum(one.number for one in found.services):8d}{'':12}{found.cores:8.1f}{found.memory_mb:12.0f}"
    yield ""
    yield from _machine_lines(installation, costs, found)
    yield ""
    for link in found.links:
        share = f", {link.rate / GIGABIT:.0%} of 1 Gbit/s" if link.rate > 0.01 * GIGABIT else ""
        yield f"{link.name}: {_amount(link.rate)}/s{share}"
    if installation.log:
        channels = " with Foxglove channels" if installation.foxglove else ""
        yield f"takes{channels}: {_amount(found.disk)}/s, {_amount(found.disk * HOUR_S)} an hour"


def _machine_lines(installation: Installation, costs: Costs, found: Demand) -> Iterator[str]:
    yield f"of all cores at most {USABLE:.0%} are planned: with more, processes wait for a core"
    yield f"smallest number of cores: {max(1, ceil(found.cores / USABLE))}"
    one_rig = replace(installation, cameras=installation.views, rigs=1, routers=0)
    busiest = max((one for one in found.services if one.service != "router"), key=lambda one: one.cores)
    if busiest.cores > LOOP_USABLE:
        fastest = highest_rate(one_rig, costs, inf)
        yield (
            f"too much for one {busiest.service}: {busiest.cores:.1f} cores, and its loop has one thread: up to "
            f"{fastest:.0f} frames/s, or smaller images, or fewer cameras in a rig"
        )
    if installation.cores is not None:
        yield f"machines of {installation.cores} cores: {found.machines}"
        rate = highest_rate(one_rig, costs, USABLE * installation.cores)
        yield f"one such machine for one rig of {one_rig.cameras} cameras: up to {rate:.0f} frames/s"


def _amount(count: float) -> str:
    if count >= GB:
        return f"{count / GB:.2f} GB"
    return f"{count / MB:.2f} MB" if count >= 0.01 * MB else f"{count / 1e3:.1f} kB"


def plans(size: tuple[int, int]) -> tuple[Plan, Plan]:
    """Two short loads: two-view, and tracker; at a rate that any machine completes."""
    base = Plan(rate=MEASURED_RATE, size=size, seconds=MEASURED_S)
    return base, replace(base, viewers=MEASURED_VIEWS, method="hybrid")


def measured(costs: Costs, size: tuple[int, int], measure: Callable[[Plan], "Measurement"]) -> Costs:
    """The costs, scaled for this machine.  Decoding, log and page keep theirs.  Raises as `measure` does."""
    two_view, hybrid = (measure(plan) for plan in plans(size))
    viewer, silhouette = _ratio(two_view, "viewer", costs), _ratio(hybrid, "viewer", costs)
    return replace(
        costs, two_view=_scaled(costs.two_view, viewer), silhouette=_scaled(costs.silhouette, silhouette),
        integrator=costs.integrator * _ratio(two_view, "integrator", costs),
        tracker=_scaled(costs.tracker, _ratio(hybrid, "tracker", costs)),
        forwarded=costs.forwarded * _ratio(two_view, "router", costs), process=costs.process * silhouette,
    )  # fmt: skip


def installation_of(plan: Plan) -> Installation:
    """The installation that a load is: films in memory, no previews, no page, one router."""
    return Installation(
        cameras=plan.viewers * plan.rigs, fps=plan.rate, size=plan.size, method=plan.method, rigs=plan.rigs, decoded=False,
        log=plan.log, foxglove=False, routers=1,
    )  # fmt: skip


def _ratio(point: "Measurement", service: str, costs: Costs) -> float:
    """Cores of a service as measured, over those of the plan at the rate that came out."""
    cores = mean(cost.cores for cost in point.costs if cost.key[1] == service)
    rate = point.figures.completed / point.seconds / point.plan.rigs
    installation = installation_of(replace(point.plan, rate=rate))
    return cores / next(one.cores for one in demand(installation, costs).services if one.service == service)


def _scaled(cost: Linear, ratio: float) -> Linear:
    return Linear(cost.base * ratio, cost.each * ratio)
