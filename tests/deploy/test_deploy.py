"""The files of deploy/ are valid for zenocap, Zenoh and systemd."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.support.places import ROOT
from zenocap.common.bus.zenoh_session import ZenohOptions, configuration
from zenocap.common.rig.rig import load_rig

DEPLOY = ROOT / "deploy"
UNITS = sorted((DEPLOY / "systemd").glob("*.service"))


@pytest.mark.parametrize("path", sorted((DEPLOY / "zenoh").glob("*.json5")), ids=lambda path: path.stem)
def test_zenoh_reads_the_configurations(path: Path) -> None:
    config = configuration(ZenohOptions(config_file=path))
    assert json.loads(config.get_json("mode")) == {"peers": "peer"}.get(path.stem, path.stem)
    assert json.loads(config.get_json("scouting/multicast/enabled")) is False
    assert json.loads(config.get_json("transport/link/tx/lease")) == 2000  # zenocap's value, which the file does not set


def test_the_rig_of_several_machines_has_certificates_and_a_router() -> None:
    rig = load_rig(DEPLOY / "rigs" / "machines.toml", files=False)
    assert rig.security == DEPLOY / "rigs" / "certs"
    assert rig.zenoh.connect == ("tls/192.168.1.10:7447",)
    assert [viewer.id for viewer in rig.viewers] == ["1", "2"]


def test_every_service_has_a_unit() -> None:
    names = ("animator", "integrator", "recognizer", "router", "tracker", "viewer@")
    assert [unit.stem for unit in UNITS] == [f"zenocap-{name}" for name in names]


@pytest.mark.parametrize("unit", UNITS, ids=lambda path: path.stem)
def test_a_unit_runs_unprivileged_and_restarts(unit: Path) -> None:
    lines = unit.read_text().splitlines()
    for line in ("User=zenocap", "Restart=always", "NoNewPrivileges=yes", "ProtectSystem=strict", "CapabilityBoundingSet="):
        assert line in lines


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="systemd-analyze is not installed")
@pytest.mark.parametrize("unit", UNITS, ids=lambda path: path.stem)
def test_systemd_accepts_the_unit(unit: Path, tmp_path: Path) -> None:
    text = unit.read_text().replace("/opt/zenocap/.venv/bin/zenocap", shutil.which("true") or "/bin/true")
    copy = tmp_path / unit.name.replace("@", "@1")
    copy.write_text(text)
    found = subprocess.run(["systemd-analyze", "verify", "--man=no", copy], capture_output=True, text=True, check=False)
    assert (found.returncode, found.stderr) == (0, "")
