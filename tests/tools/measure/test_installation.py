"""Plan of an installation: laws of the sums, documented figures, command."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.command import printed
from zenocap.common.errors import UserError
from zenocap.tools.measure.installation import Installation, checked, demand, flows, highest_rate
from zenocap.tools.measure.installation_plan import installation_of, lines_of, measured
from zenocap.tools.measure.latency import Figures
from zenocap.tools.measure.load_plan import Plan
from zenocap.tools.measure.measurement import Measurement
from zenocap.tools.measure.resources import Cost, MachineUse
from zenocap.tools.measure.unit_costs import COSTS, LOOP_USABLE, read_costs, write_costs

LARGE = Installation(24, 30.0, (640, 480))
INSTALLATIONS = st.builds(
    Installation, cameras=st.sampled_from([2, 4, 8]), fps=st.floats(1, 120), size=st.sampled_from([(160, 120), (640, 480)]),
    pages=st.integers(0, 4), routers=st.integers(0, 1), log=st.booleans(), foxglove=st.booleans(), previews=st.booleans(),
)  # fmt: skip


def cores(installation: Installation, service: str) -> float:
    return next(one.cores for one in demand(installation, COSTS).services if one.service == service)


@given(INSTALLATIONS, st.integers(1, 20))
def test_so_many_rigs_need_so_many_times_as_much(one: Installation, rigs: int) -> None:
    many = replace(one, cameras=rigs * one.cameras, rigs=rigs, routers=0)
    alone, together = demand(replace(one, routers=0), COSTS), demand(many, COSTS)
    assert together.cores == pytest.approx(rigs * alone.cores)
    assert together.memory_mb == pytest.approx(rigs * alone.memory_mb)
    assert together.disk == pytest.approx(rigs * alone.disk)


@given(INSTALLATIONS, st.floats(1.01, 4))
def test_more_frames_need_more_of_everything(installation: Installation, factor: float) -> None:
    slow, fast = demand(installation, COSTS), demand(replace(installation, fps=factor * installation.fps), COSTS)
    assert fast.cores > slow.cores
    assert fast.disk >= slow.disk
    assert all(after.rate >= before.rate for before, after in zip(slow.links, fast.links, strict=True))


@pytest.mark.slow
@given(INSTALLATIONS, st.floats(0.7, 8))
def test_the_highest_rate_needs_all_cores_or_the_time_of_a_loop(installation: Installation, available: float) -> None:
    rate = highest_rate(installation, COSTS, available)
    if rate < 1e-3:
        assert demand(replace(installation, fps=1e-3), COSTS).cores >= available
        return
    needed = demand(replace(installation, fps=rate), COSTS)
    busiest = max(one.cores for one in needed.services if one.service != "router")
    assert needed.cores == pytest.approx(available, rel=1e-3) or busiest == pytest.approx(LOOP_USABLE, rel=1e-3)


@pytest.mark.parametrize(
    ("plan", "viewer", "load"),
    [
        (Plan(rate=60.0), 0.26, 0.80),
        (Plan(rate=120.0), 0.38, 1.10),
        (Plan(rate=30.0, size=(640, 480)), 0.25, 0.63),
        (Plan(rate=60.0, size=(640, 480)), 0.48, 1.19),
    ],
)
def test_measured_loads_are_predicted(plan: Plan, viewer: float, load: float) -> None:
    """The table of the load page of November 2026, frame rate reached; the measuring process is in its sums."""
    installation = installation_of(plan)
    assert cores(installation, "viewer") == pytest.approx(viewer, rel=0.5)
    assert demand(installation, COSTS).cores == pytest.approx(load, rel=0.45)


def test_images_stay_with_their_rig_and_nothing_crosses_routers_without_a_reader() -> None:
    links = {link.name: link.rate for link in demand(replace(LARGE, rigs=4, routers=2), COSTS).links}
    none, poses, all_ = (
        links[f"router to root: {what}"]
        for what in ("no reader there", "health and poses are read there", "everything is read there")
    )
    assert none == 0 < poses < 0.5 * all_


def test_every_camera_sends_silhouettes_and_previews_only_to_those_that_read_them() -> None:
    silhouette = next(flow for flow in flows(replace(LARGE, log=False, pages=0), COSTS) if flow.name == "silhouette")
    assert (silhouette.each, silhouette.hz, silhouette.receivers) == (24, 30.0, 1)


@pytest.mark.parametrize(
    ("installation", "words"),
    [
        (replace(LARGE, cameras=1), "--cameras 1"),
        (replace(LARGE, rigs=5), "--rigs 5"),
        (replace(LARGE, method="two-view"), "--method two-view"),
        (replace(LARGE, routers=2), "--routers 2"),
    ],
)
def test_impossible_installations_are_refused(installation: Installation, words: str) -> None:
    with pytest.raises(UserError, match=words):
        checked(installation)


def test_a_service_whose_loop_has_no_time_is_named() -> None:
    text = "\n".join(lines_of(replace(LARGE, fps=200.0, cores=64), COSTS))
    assert "too much for one tracker" in text


def measurement(plan: Plan, factor: float) -> Measurement:
    """A load that costs so many times what the plan says."""
    found = demand(installation_of(plan), COSTS).services
    frames = round(8 * plan.rate)
    figures = Figures(frames, frames, 0, 0, 1.0, 1.0, {}, {}, {}, 0.0, ())
    costs = tuple(Cost(("load-1", one.service, "main"), factor * one.cores, 0) for one in found)
    return Measurement(plan, figures, costs, MachineUse(2, 1.0, 0.0), 1.0, 8.0, 0)


def test_measured_costs_predict_the_measured_load(tmp_path: Path) -> None:
    path = tmp_path / "costs.json"
    write_costs(path, measured(COSTS, (640, 480), lambda plan: measurement(plan, 1.7)))
    for plan in (Plan(rate=15.0, size=(640, 480)), Plan(viewers=4, method="hybrid", rate=15.0, size=(640, 480))):
        scaled, planned = (demand(installation_of(plan), costs).cores for costs in (read_costs(path), COSTS))
        assert scaled == pytest.approx(1.7 * planned, rel=0.2)


def test_a_file_that_holds_no_costs_is_refused(tmp_path: Path) -> None:
    (tmp_path / "costs.json").write_text("{}")
    with pytest.raises(UserError, match="no file of `zenocap plan --measure`"):
        read_costs(tmp_path / "costs.json")


@pytest.mark.slow
def test_the_command_prints_services_links_and_disk() -> None:
    out = printed("plan", "--cameras", "24", "--fps", "30", "--size", "640x480", "--cores", "4")
    for words in ("viewer", "tracker", "smallest number of cores", "machines of 4 cores", "network to tracker", "an hour"):
        assert words in out
    found = json.loads(printed("plan", "--cameras", "8", "--json"))
    assert {one["service"] for one in found["demand"]["services"]} == {"viewer", "integrator", "tracker", "animator"}
    printed("plan", "--size", "big", status=1)
