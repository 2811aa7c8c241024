"""The measured grids: rates and sizes, viewers, rigs, subscribers, router or mesh, and capacity."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from benchmarks.sections import Section, Table

from benchmarks.load.bench import Bench, limits, table
from zenocap.tools.load_test.measurement import Measurement
from zenocap.tools.load_test.plan import MAX_RATE, LoadError, Plan, RampQuantity
from zenocap.tools.load_test.ramp import ramp, ramp_lines
from zenocap.tools.load_test.text import rate_line

SMALL, LARGE = (160, 120), (640, 480)
RATES, VIEWERS, RIGS, SUBSCRIBERS = (15.0, 30.0, 60.0, 120.0), (2, 4, 8, 16, 32), (1, 4, 16), (0, 1, 4, 16)
ONE_MACHINE = "All processes are on one machine; cores used by other programs are listed beside those of the load."


def rates(bench: Bench) -> Section:
    plans = [Plan(rate=rate, size=size) for size in (SMALL, LARGE) for rate in RATES]
    return _section(bench, "rates", "Two viewers", (ONE_MACHINE,), plans, "frames/s of each viewer", lambda plan: plan.rate)


def unlimited(bench: Bench) -> Section:
    """Frame sets per second when more are offered than any machine completes, and the cores that they cost."""
    found = bench.points([Plan(rate=MAX_RATE, size=size) for size in (SMALL, LARGE)])
    lines = tuple((plan.title(), rate_line(point) if point else "no pose") for plan, point in found)
    tables = (table("Offered without limit", found), Table("Frame sets and cores", ("what", "result"), lines))
    return Section("unlimited", "Two viewers, offered without limit", (ONE_MACHINE,), tables)


def viewers(bench: Bench) -> Section:
    """Cost by viewers: poses of the tracker, then only silhouettes of real viewers, then of stand-ins."""
    plans = [
        *(Plan(viewers=count, rate=15.0, method="hybrid") for count in VIEWERS),
        *(Plan(viewers=count, method="hybrid", until="silhouette") for count in VIEWERS),
        *(Plan(viewers=count, method="hybrid", until="silhouette", stand_ins=True) for count in VIEWERS),
    ]
    notes = (
        ONE_MACHINE,
        "With the tracker: 15 frames/s. Silhouettes only, 30 frames/s: a frame set is complete when the silhouettes of all "
        "views are received, without the tracker; stand-ins compute nothing, so that only the network is measured.",
    )
    found = bench.points(plans)
    kinds: dict[str, list[Measurement]] = {}
    for plan, point in found:
        if point is not None:
            kinds.setdefault(_kind(plan), []).append(point)
    pictures = tuple(
        bench.keep(f"viewers-{k}", points, "viewers", lambda plan: plan.viewers) for k, points in kinds.items()
    )
    return Section("viewers", "Cost by viewers", notes, (table("Viewers", found), limits(found)), pictures)


def rigs(bench: Bench) -> Section:
    plans = [Plan(rigs=count, rate=15.0, stand_ins=stand_ins) for stand_ins in (False, True) for count in RIGS]
    notes = (ONE_MACHINE, "Each rig has two viewers and an integrator; all are clients of one router.")
    return _section(bench, "rigs", "Rigs on one router", notes, plans, "rigs", lambda plan: plan.rigs)


def subscribers(bench: Bench) -> Section:
    plans = [Plan(stand_ins=True, subscribers=count) for count in SUBSCRIBERS]
    plans += [replace(plan, subscriber_priority="normal") for plan in plans if plan.subscribers]
    notes = (ONE_MACHINE, "Each subscriber receives and decodes every message of the rig.")
    return _section(bench, "subscribers", "Subscribers", notes, plans, "subscribers", lambda plan: plan.subscribers)


def network(bench: Bench) -> Section:
    plans = [Plan(stand_ins=stand_ins, mesh=mesh) for stand_ins in (False, True) for mesh in (False, True)]
    found = bench.points(plans)
    notes = (
        ONE_MACHINE,
        "Order of the rows: through a router, as a mesh of peers; with real viewers, then with stand-ins.",
    )
    return Section("network", "Router or mesh", notes, (table("Router, mesh", found), limits(found)))


def capacity(bench: Bench) -> Section:
    """Capacity: the largest load without loss and with p99 within one frame period."""
    rows: list[tuple[str, str]] = []
    measured: list[Measurement] = []
    starts: list[tuple[RampQuantity, Plan]] = [
        ("rate", Plan(rate=30.0)),
        ("rate", Plan(rate=15.0, size=LARGE)),
        ("rate", Plan(rate=60.0, stand_ins=True)),
        ("rate", Plan(viewers=4, rate=7.5, method="hybrid")),
        ("rigs", Plan(rate=15.0)),
        ("rigs", Plan(rate=15.0, stand_ins=True)),
    ]
    for what, plan in starts:
        if bench.stopped():
            break
        measure = replace(plan, seconds=bench.seconds)
        try:
            found = ramp(measure, what, bench.session.measure, bench.stopped, lambda point: None)
        except LoadError as error:
            rows.append((plan.title(), str(error)))
            continue
        measured += found.points
        rows.append((f"more {what}, from: {plan.title()}", "; ".join(ramp_lines(found))))
    if measured:
        bench.keep("capacity", measured, "frames/s of all viewers", lambda plan: plan.rate * plan.viewers * plan.rigs)
    return Section("capacity", "The largest load held", (ONE_MACHINE,), (Table("Limits", ("what", "result"), tuple(rows)),))


def _section(
    bench: Bench, name: str, title: str, notes: tuple[str, ...], plans: Sequence[Plan], label: str,
    value: Callable[[Plan], float],
) -> Section:  # fmt: skip
    found = bench.points(plans)
    measured = [point for _, point in found if point is not None]
    pictures = []
    for kind in dict.fromkeys(_kind(point.plan) for point in measured):
        pictures.append(bench.keep(f"{name}-{kind}", [p for p in measured if _kind(p.plan) == kind], label, value))
    return Section(name, title, notes, (table(title, found), limits(found)), tuple(pictures))


def _kind(plan: Plan) -> str:
    return f"{plan.size[0]}-{plan.until}{'-stand-ins' if plan.stand_ins else ''}"
