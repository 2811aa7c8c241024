"""Forked readers answer as processes that are started."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.common.formats.test_c3d_reader import FALSE_DIMENSION, damage
from tests.support import forked_readers
from tests.support.marker_files import acted_centres, write_points
from zenocap.common.formats import c3d_reader


@pytest.mark.slow
@pytest.mark.parametrize("status", [0, 1, -11], ids=["read", "refused", "ended by a signal"])
def test_status_and_output_are_those_of_a_process_that_is_started(tmp_path: Path, status: int) -> None:
    path = tmp_path / "a.c3d"
    write_points(path, acted_centres())
    if status == 1:
        path.write_bytes(path.read_bytes()[:600])
    elif status:
        damage(path, *FALSE_DIMENSION)
    command = [sys.executable, "-P", "-m", c3d_reader.__name__, str(path)]
    started, forked = subprocess.run(command, capture_output=True, check=False), forked_readers.run(command)
    assert started.returncode == status
    assert (forked.returncode, forked.stdout, forked.stderr) == (status, started.stdout, started.stderr)
