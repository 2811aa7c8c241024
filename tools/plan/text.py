"""The plan as plain text."""

from collections.abc import Iterator
from dataclasses import replace
from math import inf

from zenocap.tools.plan.calculator import Demand, Installation, demand, highest_rate
from zenocap.tools.plan.costs import Costs
from zenocap.tools.plan.parameters import GIGABIT, LOOP_USABLE, USABLE

HOUR_S, MB, GB = 3600, 1e6, 1e9


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
    yield f"smallest number of cores: {_whole(found.cores / USABLE)}"
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


def _whole(cores: float) -> int:
    return max(1, int(-(-cores // 1)))


def _amount(count: float) -> str:
    if count >= GB:
        return f"{count / GB:.2f} GB"
    return f"{count / MB:.2f} MB" if count >= 0.01 * MB else f"{count / 1e3:.1f} kB"
