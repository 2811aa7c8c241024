"""The files of deploy/ are valid for zenocap, Zenoh and systemd."""

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest
import yaml

from tests.support.places import ROOT
from zenocap.common.bus.zenoh_session import ZenohOptions, configuration
from zenocap.common.rig.rig import load_rig
from zenocap.tools.record.launcher.child_processes import STOPPED_S

DEPLOY = ROOT / "deploy"
UNITS = sorted((DEPLOY / "systemd").glob("*.service"))
TIMERS = sorted((DEPLOY / "systemd").glob("*.timer"))


@pytest.mark.parametrize("path", sorted((DEPLOY / "zenoh").glob("*.json5")), ids=lambda path: path.stem)
def test_zenoh_reads_the_configurations(path: Path) -> None:
    config = configuration(ZenohOptions(config_file=path))
    assert json.loads(config.get_json("mode")) == {"peers": "peer"}.get(path.stem, path.stem)
    assert json.loads(config.get_json("scouting/multicast/enabled")) is False
    assert json.loads(config.get_json("transport/link/tx/lease")) == 2000  # zenocap's value, which the file does not set


def test_a_service_has_as_long_to_end_as_the_launcher_gives_it() -> None:
    files = [DEPLOY / "compose.yaml", *(unit for unit in UNITS if "Type=oneshot" not in unit.read_text())]
    given = [
        re.findall(r"^(?:  stop_grace_period: |TimeoutStopSec=)(\d+)", file.read_text(), re.MULTILINE) for file in files
    ]
    assert given == [[f"{STOPPED_S:g}"]] * len(files)


def test_the_rig_of_several_machines_has_certificates_and_a_router() -> None:
    rig = load_rig(DEPLOY / "rigs" / "machines.toml", files=False)
    assert rig.security == DEPLOY / "rigs" / "certs"
    assert rig.zenoh.connect == ("tls/192.168.1.10:7447",)
    assert [viewer.id for viewer in rig.viewers] == ["1", "2"]


def test_every_service_has_a_unit() -> None:
    names = ("animator", "certs", "integrator", "recognizer", "router", "tracker", "viewer@")
    assert [unit.stem for unit in UNITS] == [f"zenocap-{name}" for name in names]


@pytest.mark.parametrize("unit", UNITS, ids=lambda path: path.stem)
def test_a_unit_runs_unprivileged_and_restarts(unit: Path) -> None:
    lines = unit.read_text().splitlines()
    for line in ("User=zenocap", "NoNewPrivileges=yes", "ProtectSystem=strict", "CapabilityBoundingSet="):
        assert line in lines
    assert ("Restart=always" in lines) == ("Type=oneshot" not in lines)  # a timer starts the other again


@pytest.mark.parametrize("unit", UNITS, ids=lambda path: path.stem)
def test_a_unit_has_limits(unit: Path) -> None:
    names = {line.partition("=")[0] for line in unit.read_text().splitlines()}
    assert {"MemoryMax", "TasksMax", "LimitNOFILE", "CPUQuota"} <= names


def test_every_container_has_limits() -> None:
    """In the part that all services merge; only the tracker has another limit of its own."""
    text = (DEPLOY / "compose.yaml").read_text()
    common = text[text.index("x-service:") : text.index("x-open:")]
    for key in ("mem_limit", "memswap_limit", "pids_limit", "cpus", "ulimits"):
        assert f"\n  {key}: " in common
    assert text.count("mem_limit: ") == 1
    services = text[text.index("\nservices:") : text.index("\nvolumes:")]
    assert services.count("\n    <<: *") == len(re.findall(r"\n  [a-z0-9\-]+:\n", services))


def test_containers_are_made_after_the_one_that_fills_the_shared_volume() -> None:
    """Docker copies the kernels of the image into an empty volume, and two copies at once fail."""
    services = yaml.safe_load((DEPLOY / "compose.yaml").read_text())["services"]
    sharing = {name for name, one in services.items() if "compiled:/var/cache/zenocap" in one["volumes"]}
    first = {name for name in sharing if "depends_on" not in services[name]}
    assert first == {"router", "secure-router"}
    for name in sharing - first:
        (before,) = services[name]["depends_on"]
        assert services[before]["profiles"] == services[name]["profiles"] or name == "tracker"


def test_the_page_has_the_smallest_share_of_the_processor() -> None:
    text = (DEPLOY / "compose.yaml").read_text()
    services = re.split(r"\n  (?=[a-z0-9\-]+:\n)", text[text.index("\nservices:") : text.index("\nvolumes:")])
    shares = {one.partition(":")[0]: re.findall(r"    cpu_shares: (\S+)", one) for one in services if "cpu_shares" in one}
    # A literal number: docker-compose 1 (of Debian) passes an environment variable on as a string, and then fails.
    assert shares == {"animator": ["128"], "secure-animator": ["128"]}


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="systemd-analyze is not installed")
@pytest.mark.parametrize("unit", [*UNITS, *TIMERS], ids=lambda path: path.name)
def test_systemd_accepts_the_unit(unit: Path, tmp_path: Path) -> None:
    text = unit.read_text().replace("/opt/zenocap/.venv/bin/zenocap", shutil.which("true") or "/bin/true")
    copy = tmp_path / unit.name.replace("@", "@1")
    copy.write_text(text)
    if unit.suffix == ".timer":  # names its service
        service = unit.with_suffix(".service").read_text()
        copy.with_suffix(".service").write_text(service.replace("/opt/zenocap/.venv/bin/zenocap", "/bin/true"))
    found = subprocess.run(["systemd-analyze", "verify", "--man=no", copy], capture_output=True, text=True, check=False)
    assert (found.returncode, found.stderr) == (0, "")
