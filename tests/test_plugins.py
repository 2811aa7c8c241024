"""Example packages of `examples/plugin`: installed, and chosen as zenocap's own."""

import os
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from tests.common.rig.test_animator import RIG as RIG_TEXT
from tests.common.rig.test_animator import write_rig
from tests.support.places import GOLDEN, ROOT
from tests.support.processes import PATIENCE_S

PLUGINS = ROOT / "examples" / "plugin"


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Environment with all example packages; built from copies, since a build leaves files beside its sources."""
    folder = tmp_path_factory.mktemp("plugins")
    copies = [shutil.copytree(path, folder / "sources" / path.name) for path in PLUGINS.iterdir() if path.is_dir()]
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation"]
    subprocess.run([*pip, "--target", folder / "site", *copies], check=True)
    path = os.pathsep.join([str(folder / "site"), *filter(None, [os.environ.get("PYTHONPATH")])])
    return {**os.environ, "PYTHONPATH": path}


def zenocap(environment: dict[str, str], *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-P", "-m", "zenocap", *map(str, arguments)]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.core
def test_a_format_of_a_package_is_exported_by_its_suffix(installed: dict[str, str], tmp_path: Path) -> None:
    done = zenocap(installed, "export", GOLDEN / "arms.mcap", "-o", tmp_path / "arms.sto")
    assert (done.returncode, done.stderr) == (0, "")
    assert "97 frames" in done.stdout
    head, kind, version, end, names, *rows = (tmp_path / "arms.sto").read_text().splitlines()
    assert (head, kind, version, end) == ("arms", "DataType=Vec3", "version=3", "endheader")
    assert names.split("\t")[0] == "time"
    assert len(rows) == 97
    assert {len(row.split("\t")) for row in rows} == {len(names.split("\t"))}


@pytest.mark.core
def test_a_suffix_that_nobody_writes_lists_that_of_the_package(installed: dict[str, str], tmp_path: Path) -> None:
    done = zenocap(installed, "export", GOLDEN / "arms.mcap", "-o", tmp_path / "arms.fbx")
    assert done.returncode == 2
    assert ".sto" in done.stderr.replace("\n", "")


@pytest.mark.core
def test_an_output_of_a_package_gets_the_poses_of_a_rig(installed: dict[str, str], tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listening:
        listening.bind(("127.0.0.1", 0))
        listening.settimeout(PATIENCE_S)
        rig = write_rig(tmp_path, f"{RIG_TEXT}[animator.osc]\nport = {listening.getsockname()[1]}\n")
        code = (
            "import sys\n"
            "from tests.support.virtual_actors import stretched\n"
            "from zenocap.common.rig.rig import load_rig\n"
            "from zenocap.common.runtime.clock import RealClock\n"
            "from zenocap.services.animator.outputs.output_group import open_outputs\n"
            "outputs = open_outputs(load_rig(sys.argv[1]).animator, 'studio', RealClock())\n"
            "outputs.send(stretched('ten-parts'), None)\n"
            "print(outputs.titles, outputs.counts())\n"
        )
        done = subprocess.run(
            [sys.executable, "-c", code, str(rig)], env=installed, cwd=ROOT, capture_output=True, text=True, check=True
        )
        first = listening.recv(1000)
    assert "animator.osc 127.0.0.1" in done.stdout
    assert "'osc_sent': 15" in done.stdout
    assert first.startswith(b"/zenocap/Hip")


@pytest.mark.core
def test_a_wrong_key_of_a_packages_table_is_an_error_with_the_allowed_ones(
    installed: dict[str, str], tmp_path: Path
) -> None:
    rig = write_rig(tmp_path, f"{RIG_TEXT}[animator.osc]\nprot = 1\n")
    done = zenocap(installed, "animator", rig)
    assert done.returncode == 1
    assert "animator.osc.prot = 1: no such key; allowed: enabled, host, port, root" in done.stderr.replace("\n", " ")
