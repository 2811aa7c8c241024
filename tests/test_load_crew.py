"""Which processes a load is, and how they meet."""

from pathlib import Path

from services.load.crew import Crew
from services.load.plan import Plan


def crew(plan: Plan, connect: tuple[str, ...] = ()) -> Crew:
    """Nothing is started."""
    return Crew(plan, tuple(Path(f"{name}.toml") for name in plan.rig_names), Path("takes"), 5, connect, None)


def services(one: Crew) -> list[tuple[str, str, str]]:
    return [post.who for post in one.posts.values()]


def test_a_rig_is_its_viewers_and_its_integrator_around_a_router() -> None:
    one = crew(Plan(rigs=2))
    assert services(one) == [
        ("", "router", "main"),
        ("load-1", "integrator", "main"), ("load-1", "viewer", "1"), ("load-1", "viewer", "2"),
        ("load-2", "integrator", "main"), ("load-2", "viewer", "1"), ("load-2", "viewer", "2"),
    ]  # fmt: skip
    assert one.own.mode == "client"
    assert one.own.connect[0].startswith("tcp/127.0.0.1:")


def test_a_tracker_is_there_when_it_has_something_to_do() -> None:
    plan = Plan(viewers=3, method="hybrid")
    assert ("load-1", "tracker", "main") in services(crew(plan))
    assert ("load-1", "tracker", "main") not in services(crew(Plan(viewers=3, method="hybrid", until="silhouette")))


def test_a_running_network_needs_no_router() -> None:
    one = crew(Plan(), ("tcp/192.0.2.1:7447",))
    assert ("", "router", "main") not in services(one)
    assert one.own.connect == ("tcp/192.0.2.1:7447",)


def test_parts_make_a_whole() -> None:
    plan = Plan(subscribers=1)
    remote = ("tcp/192.0.2.1:7447",)
    here = services(crew(Plan(subscribers=1, part="viewers"), remote))
    there = services(crew(Plan(subscribers=1, part="integrators"), remote))
    assert sorted(here + there) == sorted(services(crew(plan, remote)))


def test_peers_of_a_mesh_listen_and_the_measuring_is_one_of_them() -> None:
    one = crew(Plan(mesh=True))
    assert ("", "router", "main") not in services(one)
    assert one.own.mode == "peer"
    assert len(one.own.connect) == 3


def test_stand_ins_and_subscribers_are_members_of_their_own() -> None:
    posts = crew(Plan(stand_ins=True, subscribers=2)).posts
    assert "stand-in" in posts["load-1 viewer 1"].command
    assert "subscriber" in posts["load-1 subscriber 2"].command
