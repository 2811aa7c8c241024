"""Load test and `top` on real processes: all start, are measured and monitored, and end completely."""

import json
from pathlib import Path

import psutil
import pytest

from tests.support.command import zenocap
from tests.support.processes import completed

pytestmark = pytest.mark.nightly  # it measures what this machine can do, which other load changes


def remaining_processes(name: str) -> list[str]:
    """Command lines of processes whose rig is one of this load's."""
    found = []
    for process in psutil.process_iter(["cmdline"]):
        words = process.info["cmdline"] or []
        found += [" ".join(words) for word in words if f"/{name}-1.toml" in word]
    return found


def test_stand_ins_are_measured_to_the_pose(tmp_path: Path) -> None:
    what = ("--silhouettes", "--subscribers", 1, "--rate", 15, "--seconds", 2, "--settle", 1, "--size", "64x48")
    done = completed(["load", *what, "--name", "small", "-o", tmp_path, "--json"], tmp_path)
    assert done.returncode in (0, 3), done.stderr  # a busy machine may lose messages
    found = json.loads(done.stdout)
    assert found == json.loads((tmp_path / "load.json").read_text())
    (point,) = found["points"]
    assert 5 < point["offered"] < 34
    assert point["completed"] > 0
    services = {service["service"] for service in point["services"]}
    assert services == {"router", "integrator", "viewer", "subscriber", "measuring"}
    assert point["bottleneck"]
    assert (tmp_path / "load.csv").read_text().count("\n") == 2
    assert (tmp_path / "load.png").stat().st_size > 1000
    assert remaining_processes("small") == []


def test_offered_far_more_than_any_machine_can_do_whole_instants_come_out(tmp_path: Path) -> None:
    """Both viewers leave out the same instants; without a common decision hardly any instant had both views."""
    what = ("--rate", 600, "--seconds", 5, "--settle", 12)
    done = completed(["load", *what, "--name", "overload", "-o", tmp_path, "--json"], tmp_path)
    assert done.returncode == 3, done.stderr
    (point,) = json.loads(done.stdout)["points"]
    skipped = [service["lost"]["skipped_frames"] for service in point["services"] if service["service"] == "viewer"]
    assert min(skipped) > 0.5 * point["offered"]
    assert max(skipped) - min(skipped) < 0.25 * point["offered"]  # one may be starved by what runs beside it
    assert point["completed"] >= 5 * 5  # the lowest rate
    assert point["partial"] <= 0.5 * point["completed"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--viewers", "4", "--method", "two-view"], "--viewers 4"),
        (["--size", "12x"], "--size '12x'"),
        (["--part", "viewers"], "--part viewers"),
        (["--soak", "1", "--ramp", "rate"], "--soak --ramp"),
        (["--mesh", "-e", "tcp/192.0.2.1:7447"], "--mesh --connect"),
    ],
)
def test_impossible_options_are_rejected(arguments: list[str], words: str) -> None:
    status, _, error = zenocap("load", *arguments)
    assert status == 2
    assert words in error


def test_top_reports_an_empty_network(tmp_path: Path) -> None:
    done = completed(["top", "--once", "--no-multicast-scouting", "-l", "tcp/127.0.0.1:0"], tmp_path)
    assert done.returncode == 1
    assert "no service found" in done.stdout
