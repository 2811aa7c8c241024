"""Cached kernels: never older than their sources, shared by every checkout."""

import os
import pickle
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.support.places import ROOT
from zenocap.common.cache import write_entry
from zenocap.common.jit import _folder, kernel
from zenocap.common.source_digests import kernel_digests

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
RUN = """
from zenocap.caller import twice
value = twice(1.0)
print(value, sum(twice.stats.cache_hits.values()))
"""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A small package named zenocap, with the real `common/jit.py`."""
    folder = tmp_path / "zenocap"
    (folder / "common").mkdir(parents=True)
    for name in ("__init__.py", "common/__init__.py"):
        (folder / name).write_text("")
    for name in ("jit.py", "cache.py", "source_digests.py"):
        shutil.copy(ROOT / "common" / name, folder / "common" / name)
    (folder / "constants.py").write_text("FACTOR = 3.0\n")
    (folder / "callee.py").write_text(CALLEE)
    (folder / "caller.py").write_text(CALLER)
    (folder / "other.py").write_text("from zenocap.common.jit import kernel\n")
    return folder


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("ZENOCAP_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def result(package: Path) -> tuple[float, int]:
    """`twice(1.0)` in a separate process, and whether its machine code came from the cache."""
    environment = {**os.environ, "PYTHONPATH": str(package.parent)}
    done = subprocess.run([sys.executable, "-P", "-c", RUN], env=environment, capture_output=True, text=True, check=True)
    value, hits = done.stdout.split()
    return float(value), int(hits)


@pytest.mark.nightly
def test_what_is_used_follows_the_sources_and_serves_other_checkouts(package: Path, cache: Path, tmp_path: Path) -> None:
    other = tmp_path / "elsewhere" / "zenocap"
    shutil.copytree(package, other)
    assert result(package) == (6.0, 0)
    assert result(other) == (6.0, 1)
    (package / "constants.py").write_text("FACTOR = 5.00\n")
    assert result(package) == (10.0, 0)
    (package / "callee.py").write_text(CALLEE.replace("FACTOR * x", "FACTOR * x + 1.0"))
    assert result(package) == (12.0, 0)
    assert result(other) == (6.0, 1)


def double(x: float) -> float:
    return 2.0 * x


def half(x: float) -> float:
    return 0.5 * x


def from_cache(function: Callable[[float], float]) -> bool:
    """Whether a new kernel of a function takes its machine code from the cache."""
    compiled = kernel(function)
    assert compiled(3.0) == function(3.0)
    return sum(compiled.stats.cache_hits.values()) == 1


@pytest.fixture
def entry(cache: Path) -> Iterator[Path]:
    """The entry of `double`."""
    _folder.cache_clear()
    assert not from_cache(double)
    assert from_cache(double)
    (path,) = (cache / "kernels").rglob("double-*")
    yield path
    _folder.cache_clear()


def of_another_function(entry: Path) -> None:
    assert not from_cache(half)
    (foreign,) = entry.parent.glob("half-*")
    entry.write_bytes(foreign.read_bytes())


@pytest.mark.slow
@pytest.mark.parametrize(
    "change",
    [
        lambda entry: entry.write_bytes(b""),
        lambda entry: entry.write_bytes(b"damaged"),
        lambda entry: entry.write_bytes(entry.read_bytes()[:-7] + b"1234567"),
        lambda entry: write_entry(entry, b"no pickle"),
        lambda entry: write_entry(entry, pickle.dumps(("double", "key", "data"))),
        lambda entry: write_entry(entry, b"cmissing_module\nname\n."),
        of_another_function,
    ],
    ids=["empty", "damaged", "wrong end", "no pickle", "other content", "pickle of a missing module", "other function"],
)
def test_a_damaged_entry_or_one_with_other_content_is_compiled_again(entry: Path, change: Callable[[Path], object]) -> None:
    change(entry)
    assert not from_cache(double)
    assert from_cache(double)


@pytest.mark.slow
def test_without_a_cache_everything_is_compiled(entry: Path, cache: Path) -> None:
    shutil.rmtree(cache)
    cache.write_text("in the way")
    assert not from_cache(double)
    assert not from_cache(double)


def test_only_files_that_depend_on_a_change_have_another_digest(package: Path, cache: Path) -> None:
    before = kernel_digests(package)
    assert set(before) == {"callee.py", "caller.py", "other.py"}
    assert kernel_digests(package) == before
    (package / "callee.py").write_text(CALLEE + "\n")
    after = kernel_digests(package)
    assert {name for name in after if after[name] != before[name]} == {"callee.py", "caller.py"}
    (package / "caller.py").touch()  # the same content
    assert kernel_digests(package) == after


def test_a_new_file_with_kernels_is_not_missed(package: Path, cache: Path) -> None:
    before = kernel_digests(package)
    (package / "fresh.py").write_text(CALLEE)
    assert set(kernel_digests(package, "fresh.py")) == {*before, "fresh.py"}


def test_a_damaged_record_counts_as_missing(package: Path, cache: Path) -> None:
    before = kernel_digests(package)
    (record,) = (cache / "sources").iterdir()
    record.write_text("{")
    assert kernel_digests(package) == before
