"""The command `replay`: what cannot be replayed is said in one line, with the right status and without a network."""

from dataclasses import replace
from pathlib import Path

import pytest

from common.take.reading import TakeError
from services.takes.replay.renaming import Renaming
from services.takes.replay.selection import Selection
from services.takes.replay.shell import Wishes, planned, rig_of, services_of
from services.takes.replay.timeline import Timeline
from tests.replay_takes import PERIOD_NS, spoken, written
from tests.test_cli import zenocap

ALL = Wishes(Selection(), Renaming())


@pytest.fixture
def take(tmp_path: Path) -> Path:
    return written(tmp_path / "take.mcap", spoken(50))


def line(*arguments: object) -> tuple[int, str]:
    """Exit status, and the one line of what went wrong."""
    status, out, err = zenocap("replay", *arguments)
    assert out == ""
    lines = [one for one in err.splitlines() if one.startswith("error: ")]
    assert len(lines) == 1
    return status, lines[0]


def test_what_is_no_take_is_said(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(b"no take")
    assert line(path) == (1, f"error: {path} is no MCAP file")
    status, text = line(tmp_path / "none.mcap")
    assert (status, "cannot be read" in text) == (1, True)


def test_when_nothing_is_selected_the_keys_there_are_are_said(take: Path) -> None:
    status, text = line(take, "--topics", "viewer/7/**")
    assert status == 1
    assert "nothing to replay" in text
    for each in spoken(1):
        assert each.key in text


def test_a_start_behind_the_end_is_refused(take: Path) -> None:
    status, text = line(take, "--start-offset", "60")
    assert (status, "--start-offset 60: allowed: below 0.492 s" in text) == (1, True)


@pytest.mark.parametrize(
    "arguments",
    [
        ("--topics", "viewer//bap"),
        ("--exclude", "/viewer"),
        ("--remap", "viewer/1"),
        ("--remap", "viewer/1:=viewer/2"),
        ("--remap", "viewer/1/bdp:=viewer/1/sighting"),
        ("--rig", "a/b"),
        ("--rate", "-1"),
        ("--duration", "-1"),
    ],
)
def test_wrong_usage_is_status_2(take: Path, arguments: tuple[str, ...]) -> None:
    status, _, err = zenocap("replay", take, *arguments)
    assert status == 2
    assert arguments[0] in err


def test_the_plan_is_the_chosen_keys_and_part(take: Path) -> None:
    wishes = replace(ALL, selection=Selection(("viewer/2/**",)), start_s=0.1, duration_s=0.2, loop=True)
    plan = planned(Timeline([take]), wishes)
    assert sorted(plan.keys) == ["zenocap/demo/viewer/2/bdp", "zenocap/demo/viewer/2/sighting"]
    assert (plan.begin_ns, plan.end_ns, plan.loop) == (100_000_000, 300_000_000, True)
    assert services_of(plan) == {("viewer", "2")}
    assert rig_of(plan) == "demo"


def test_the_services_stood_in_for_are_those_of_the_chosen_keys(take: Path) -> None:
    plan = planned(Timeline([take]), replace(ALL, renaming=Renaming(rig="lab")))
    assert services_of(plan) == {("viewer", "1"), ("viewer", "2"), ("integrator", "main")}
    assert rig_of(plan) == "lab"
    assert abs(plan.period_ns - PERIOD_NS) < PERIOD_NS / 10


def test_two_rigs_are_not_replayed_as_one(tmp_path: Path) -> None:
    other = [replace(each, key=each.key.replace("demo", "lab")) for each in spoken(5)]
    take = written(tmp_path / "two.mcap", [*spoken(5), *other])
    plan = planned(Timeline([take]), ALL)
    with pytest.raises(TakeError, match=r"several rigs: demo, lab: choose one, such as --topics 'zenocap/demo/\*\*'"):
        rig_of(plan)
    with pytest.raises(ValueError, match="would both become"):
        planned(Timeline([take]), replace(ALL, renaming=Renaming(rig="one")))
