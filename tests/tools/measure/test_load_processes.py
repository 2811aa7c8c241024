"""Processes of a load, and the network between them."""

from pathlib import Path

import pytest

from zenocap.tools.measure.load_plan import Plan, Priority
from zenocap.tools.measure.load_processes import Deployment, LoadNetwork, LoadProcesses


def processes(plan: Plan, connect: tuple[str, ...] = ()) -> LoadProcesses:
    """Processes that are not started."""
    rigs = tuple(Path(f"{name}.toml") for name in plan.rig_names)
    return LoadProcesses(plan, Deployment(rigs, Path("takes"), LoadNetwork(connect)), epoch_ns=5)


def services(one: LoadProcesses) -> list[tuple[str, str, str]]:
    return [spec.key for spec in one.specs.values()]


ROUTER, TRACKER, REMOTE = ("", "router", "main"), ("load-1", "tracker", "main"), ("tcp/192.0.2.1:7447",)


def test_a_rig_has_viewers_and_an_integrator_around_a_router() -> None:
    one = processes(Plan(rigs=2))
    assert services(one) == [
        ROUTER,
        ("load-1", "integrator", "main"), ("load-1", "viewer", "1"), ("load-1", "viewer", "2"),
        ("load-2", "integrator", "main"), ("load-2", "viewer", "1"), ("load-2", "viewer", "2"),
    ]  # fmt: skip
    assert one.own.mode == "client"
    assert one.own.connect[0].startswith("tcp/127.0.0.1:")


def test_a_tracker_runs_when_poses_are_measured() -> None:
    assert TRACKER in services(processes(Plan(viewers=3, method="hybrid")))
    assert TRACKER not in services(processes(Plan(viewers=3, method="hybrid", until="silhouette")))


def test_a_running_network_needs_no_router() -> None:
    one = processes(Plan(), REMOTE)
    assert ROUTER not in services(one)
    assert one.own.connect == REMOTE


def test_the_parts_together_are_the_whole_load() -> None:
    viewers, integrators, whole = (
        services(processes(Plan(subscribers=1, part=part), REMOTE)) for part in ("viewers", "integrators", "all")
    )
    assert sorted(viewers + integrators) == sorted(whole)


def test_the_measuring_process_is_a_peer_of_the_mesh() -> None:
    one = processes(Plan(mesh=True))
    assert ROUTER not in services(one)
    assert one.own.mode == "peer"
    assert len(one.own.connect) == 3


def test_stand_ins_and_subscribers_are_processes_of_their_own() -> None:
    specs = processes(Plan(stand_ins=True, subscribers=2)).specs
    assert "stand-in" in specs["load-1 viewer 1"].command
    assert "subscriber" in specs["load-1 subscriber 2"].command


@pytest.mark.parametrize("priority", ["low", "normal"])
def test_the_priority_of_subscribers_is_in_their_command(priority: Priority) -> None:
    command = processes(Plan(subscribers=1, subscriber_priority=priority)).specs["load-1 subscriber 1"].command
    assert command[-2:] == ("--priority", priority)
