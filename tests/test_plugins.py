"""The example packages under `examples/plugin` are installed, and what they bring can be chosen as zenocap's own."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.places import GOLDEN, ROOT

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
