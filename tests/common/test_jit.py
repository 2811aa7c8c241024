"""Cached kernels are never older than the sources they were compiled from."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.places import ROOT
from zenocap.common.jit import discard_outdated

CALLEE = """
from zenocap.common.jit import kernel
from zenocap.constants import FACTOR

@kernel
def scaled(x: float) -> float:
    return FACTOR * x
"""
CALLER = """
from zenocap.common.jit import kernel
from zenocap.callee import scaled

@kernel
def twice(x: float) -> float:
    return 2.0 * scaled(x)
"""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A small package named zenocap, with the real `common/jit.py`."""
    folder = tmp_path / "zenocap"
    (folder / "common").mkdir(parents=True)
    for name in ("__init__.py", "common/__init__.py"):
        (folder / name).write_text("")
    (folder / "common" / "jit.py").write_text((ROOT / "common" / "jit.py").read_text())
    (folder / "constants.py").write_text("FACTOR = 3.0\n")
    (folder / "callee.py").write_text(CALLEE)
    (folder / "caller.py").write_text(CALLER)
    (folder / "other.py").write_text("from zenocap.common.jit import kernel\n")
    return folder


def result(package: Path, caches: Path | None) -> float:
    """`twice(1.0)` in a separate process."""
    code = "from zenocap.caller import twice; print(twice(1.0))"
    environment = {**os.environ, "PYTHONPATH": str(package.parent)}
    environment.pop("NUMBA_CACHE_DIR", None)
    if caches is not None:
        environment["NUMBA_CACHE_DIR"] = str(caches)
    done = subprocess.run([sys.executable, "-P", "-c", code], env=environment, capture_output=True, text=True, check=True)
    return float(done.stdout)


@pytest.mark.parametrize("own_folder", [False, True])
def test_a_changed_callee_or_constant_is_used_at_once(package: Path, tmp_path: Path, own_folder: bool) -> None:
    caches = tmp_path / "caches" if own_folder else None
    assert result(package, caches) == 6.0
    (package / "constants.py").write_text("FACTOR = 5.00\n")
    assert result(package, caches) == 10.0
    (package / "callee.py").write_text(CALLEE.replace("FACTOR * x", "FACTOR * x + 1.0"))
    assert result(package, caches) == 12.0
    kept = (caches or package).rglob("caller.twice*.nbi")
    assert len(list(kept)) == 1


def test_only_files_that_depend_on_a_change_are_compiled_again(package: Path) -> None:
    assert {path.name for path in discard_outdated(package, None)} == {"callee.py", "caller.py", "other.py"}
    assert discard_outdated(package, None) == []
    (package / "callee.py").write_text(CALLEE + "\n")
    assert {path.name for path in discard_outdated(package, None)} == {"callee.py", "caller.py"}
    (package / "caller.py").touch()  # the same content
    assert discard_outdated(package, None) == []


def test_a_damaged_record_counts_as_missing(package: Path) -> None:
    discard_outdated(package, None)
    (record,) = (package / "__pycache__").glob("kernels-*.json")
    record.write_text("{")
    assert len(discard_outdated(package, None)) == 3


def test_an_unwritable_cache_folder_raises_no_error(package: Path) -> None:
    (package / "__pycache__").write_text("in the way")
    assert discard_outdated(package, None) == []
