"""Values visit each file about once."""

import subprocess
import sys

import pytest

from tests.support.places import ROOT


@pytest.mark.nightly
def test_no_walk_returns_to_files_more_often_than_it_may() -> None:
    command = [sys.executable, "-m", "tests.measures.walks", "--calls"]  # its own process: it counts calls of all kernels
    found = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout + found.stderr
