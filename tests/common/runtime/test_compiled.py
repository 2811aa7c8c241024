"""Cached machine code is valid only for the sources that it was compiled from."""

import logging
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from zenocap.common.runtime import compiled
from zenocap.common.runtime.compiled import compiling, is_compiled, record_compiled

COMPILE = """
import numpy as np
from zenocap.common.body.rotations import vector_to_matrix
from zenocap.common.runtime.compiled import record_compiled
vector_to_matrix(np.zeros(3), np.empty((3, 3)))
record_compiled("probe")
"""


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("ZENOCAP_CACHE", str(tmp_path))
    return tmp_path


@pytest.fixture
def nothing(cache: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache of a process that has compiled nothing."""
    monkeypatch.setattr(compiled, "_entries", set)
    return cache


@pytest.mark.slow
def test_a_part_counts_as_compiled_after_its_first_run(cache: Path) -> None:
    assert not is_compiled("probe")
    subprocess.run([sys.executable, "-c", COMPILE], check=True)
    assert is_compiled("probe")
    shutil.rmtree(cache / "kernels")
    assert not is_compiled("probe")


def test_a_part_counts_as_not_compiled_in_another_environment(nothing: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record_compiled("probe")
    assert is_compiled("probe")
    monkeypatch.setattr(compiled, "_environment", lambda: ("another processor",))
    assert not is_compiled("probe")


def test_a_damaged_record_counts_as_not_compiled(nothing: Path) -> None:
    record_compiled("probe")
    (record,) = (nothing / "compiled").glob("probe-*.json")
    record.write_bytes(b"{")
    assert not is_compiled("probe")


def test_compiling_is_logged_only_while_something_compiles(nothing: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    for _ in range(2):
        with compiling(logging.getLogger("viewer"), "viewer-service", "tracking"):
            pass
    assert caplog.messages == ["compiling (first run only)"]
