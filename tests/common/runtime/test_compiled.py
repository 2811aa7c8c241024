"""Cached machine code is valid only for the sources that it was compiled from."""

import logging
import os
import subprocess
import sys
from pathlib import Path

import pytest

from zenocap.common.runtime import compiled
from zenocap.common.runtime.compiled import compiling, is_compiled, record_compiled

COMPILE = """
import numpy as np
from zenocap.common.body.definition import neutral_pose
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.runtime.compiled import record_compiled
from zenocap.common.vision.model_image import matching_score
mask = np.zeros((4, 4), np.uint8)
matching_score(mask, mask)
record_compiled("probe")
"""


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    return tmp_path


def test_a_part_counts_as_compiled_after_its_first_run(cache: Path) -> None:
    assert not is_compiled("probe")
    subprocess.run([sys.executable, "-c", COMPILE], check=True, env=os.environ | {"NUMBA_CACHE_DIR": str(cache)})
    assert is_compiled("probe")
    indexes = list(cache.rglob("*.nbi"))
    for index in indexes:
        index.unlink()
    assert is_compiled("probe") is (not indexes)


def test_a_part_counts_as_not_compiled_in_another_environment(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record_compiled("probe")
    assert is_compiled("probe")
    monkeypatch.setattr(compiled, "_environment", lambda: ("another processor",))
    assert not is_compiled("probe")


def test_a_damaged_record_counts_as_not_compiled(cache: Path) -> None:
    (cache / "compiled-probe.json").write_bytes(b"{")
    assert not is_compiled("probe")


def test_compiling_is_logged_only_while_something_compiles(cache: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    for _ in range(2):
        with compiling(logging.getLogger("viewer"), "viewer-service", "tracking"):
            pass
    assert caplog.messages == ["compiling (first run only)"]
