"""The command `replay`: errors are one line with the correct exit status, without a network."""

from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.command import zenocap
from tests.support.replay_takes import PERIOD_NS, sample_messages, written
from zenocap.common.errors import UserError
from zenocap.common.formats.pose_track import Bound
from zenocap.tools.record.replay.remap import Remapping
from zenocap.tools.record.replay.selection import ReplaySelection
from zenocap.tools.record.replay.shell import ReplayOptions, planned, rig_of, services_of
from zenocap.tools.record.replay.timeline import Timeline

ALL = ReplayOptions(ReplaySelection(), Remapping())


@pytest.fixture
def take(tmp_path: Path) -> Path:
    return written(tmp_path / "take.mcap", sample_messages(50))


def error_line(*arguments: object) -> str:
    """The single error line of a command that fails with status 1."""
    status, out, err = zenocap("replay", *arguments)
    assert (status, out) == (1, "")
    (line,) = [one for one in err.splitlines() if one.startswith("error: ")]
    return line


@pytest.mark.slow
def test_file_that_is_not_a_take_is_one_error_line(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(b"no take")
    assert error_line(path) == f"error: {path} is no MCAP file"
    assert "cannot be read" in error_line(tmp_path / "none.mcap")


def test_an_empty_selection_or_range_is_refused_with_what_the_take_has(take: Path) -> None:
    assert "--from 60s: allowed: below 0.492s" in error_line(take, "--from", "60s")
    text = error_line(take, "--topics", "viewer/7/**")
    assert "nothing to replay" in text
    assert all(each.key in text for each in sample_messages(1))


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--topics", "viewer//bap"), ("--exclude", "/viewer"), ("--remap", "viewer/1"), ("--remap", "viewer/1:=viewer/2"),
        ("--remap", "viewer/1/bdp:=viewer/1/sighting"), ("--rig", "a/b"), ("--rate", "-1"), ("--until", "-1"),
    ],
)  # fmt: skip
def test_wrong_usage_is_status_2(take: Path, option: str, value: str) -> None:
    status, _, err = zenocap("replay", take, option, value)
    assert (status, option in err) == (2, True)


def test_plan_has_the_selected_keys_and_range(take: Path) -> None:
    options = replace(ALL, selection=ReplaySelection(("viewer/2/**",)), first=Bound(10), last=Bound(29), loop=True)
    plan = planned(Timeline([take]), options)
    assert sorted(plan.keys) == ["zenocap/demo/viewer/2/bdp", "zenocap/demo/viewer/2/sighting"]
    assert (plan.begin_ns, plan.end_ns, plan.loop) == (100_000_000, 300_000_000, True)
    assert services_of(plan) == {("viewer", "2")}
    assert rig_of(plan) == "demo"


def test_replayed_services_are_those_of_the_selected_keys(take: Path) -> None:
    plan = planned(Timeline([take]), replace(ALL, remapping=Remapping(rig="lab")))
    assert services_of(plan) == {("viewer", "1"), ("viewer", "2"), ("integrator", "main")}
    assert rig_of(plan) == "lab"
    assert abs(plan.period_ns - PERIOD_NS) < PERIOD_NS / 10


def test_two_rigs_cannot_be_replayed_as_one(tmp_path: Path) -> None:
    other = [replace(each, key=each.key.replace("demo", "lab")) for each in sample_messages(5)]
    take = written(tmp_path / "two.mcap", [*sample_messages(5), *other])
    plan = planned(Timeline([take]), ALL)
    with pytest.raises(UserError, match=r"several rigs: demo, lab: choose one, such as --topics 'zenocap/demo/\*\*'"):
        rig_of(plan)
    with pytest.raises(ValueError, match="would both become"):
        planned(Timeline([take]), replace(ALL, remapping=Remapping(rig="one")))
