"""Distribution as a user installs it: contents, and the demo from the wheel."""

import os
import shutil
import signal
import subprocess
import sys
import tarfile
import venv
import zipfile
from pathlib import Path

import pytest

from tests.support.places import ROOT
from tests.support.processes import all_run, ended, output_of, started, wait_until

pytestmark = [pytest.mark.core, pytest.mark.timeout(1500)]
COMPILED_S = 900.0  # time limit for a first pose of a demo that compiles all kernels (s)
PARTS = ("common", "services", "simulation", "tools", "zenocap", "pyproject.toml", "README.md", "LICENSE", "MANIFEST.in")
DATA = ("*.prior", "*.postures", "*.toml", "*.html", "*.js", "*.css", "*.svg")


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the source distribution and the wheel that is built from it."""
    folder = tmp_path_factory.mktemp("package")
    source = folder / "source"
    source.mkdir()
    for name in PARTS:
        if (ROOT / name).is_dir():
            ignored = shutil.ignore_patterns("__pycache__", "*.egg-info")
            shutil.copytree(ROOT / name, source / name, symlinks=True, ignore=ignored)
        else:
            shutil.copy2(ROOT / name, source / name)
    command = [sys.executable, "-m", "build", "--no-isolation", "-o", folder / "dist", source]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / "dist"


def wheel_in(folder: Path) -> Path:
    (wheel,) = folder.glob("*.whl")
    return wheel


def test_the_wheel_contains_only_zenocap(built: Path) -> None:
    names = zipfile.ZipFile(wheel_in(built)).namelist()
    top_level = {name.partition("/")[0] for name in names}
    assert {name for name in top_level if not name.endswith(".dist-info")} == {"zenocap"}
    assert "zenocap/py.typed" in names


def test_the_wheel_contains_every_module_and_data_file(built: Path) -> None:
    names = set(zipfile.ZipFile(wheel_in(built)).namelist())
    expected = set()
    for package in ("common", "services", "simulation", "tools", "data"):
        folder = ROOT / "zenocap" / package
        files = [path for pattern in ("*.py", *DATA) for path in folder.resolve().rglob(pattern)]
        assert files
        expected |= {f"zenocap/{package}/{path.relative_to(folder.resolve()).as_posix()}" for path in files}
    assert sorted(expected - names) == []


def test_the_source_distribution_has_no_tests(built: Path) -> None:
    (archive,) = built.glob("*.tar.gz")
    with tarfile.open(archive) as tar:
        folders = {name.split("/")[1] for name in tar.getnames() if name.count("/") > 1}
    assert folders == {"zenocap", "zenocap.egg-info"}


def test_the_demo_runs_from_the_wheel_in_another_folder(built: Path, tmp_path: Path) -> None:
    """Dependencies come from this environment; zenocap only from the wheel."""
    venv.create(tmp_path / "venv", with_pip=False)
    (packages,) = (tmp_path / "venv").glob("lib/python*/site-packages")
    with zipfile.ZipFile(wheel_in(built)) as wheel:
        wheel.extractall(packages)
    site_packages = [path for path in sys.path if Path(path).name == "site-packages"]
    (packages / "dependencies.pth").write_text("\n".join(site_packages) + "\n")
    python = tmp_path / "venv" / "bin" / "python"
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}

    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [python, *arguments], cwd=folder, env=environment, capture_output=True, text=True, check=False
        )

    found = run("-c", "import zenocap; print(zenocap.__file__)")
    assert Path(found.stdout.strip()).parent == packages / "zenocap", found.stderr
    assert "No module named 'common'" in run("-c", "import common").stderr
    with started(["demo", "--no-page"], folder, {"PYTHONPATH": ""}, [str(python), "-m", "zenocap"]) as demo:
        wait_until(lambda: all_run(folder), folder, COMPILED_S)
        assert ended(demo, signal.SIGINT) == 0, output_of(folder)
        assert "not accounted for" not in output_of(folder)
    assert "first pose" in output_of(folder), output_of(folder)
    assert len(list((folder / "recordings").glob("demo-*.mcap"))) == 1
