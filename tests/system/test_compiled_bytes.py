"""Compiled and loaded kernels give equal bytes."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.places import CLIPS

pytestmark = [pytest.mark.nightly, pytest.mark.clips, pytest.mark.timeout(600)]


def test_take_is_equal_with_empty_and_with_full_compilation_cache(tmp_path: Path) -> None:
    """Fast-math flags that reorder sums or fuse operations break this: code is optimized with its callees or without."""
    clip = CLIPS / "walk7"
    if not clip.is_dir():
        pytest.skip("the shared clips are not beside the checkout")
    environment = {**os.environ, "ZENOCAP_CACHE": str(tmp_path / "cache")}
    takes = [tmp_path / name for name in ("empty.mcap", "full.mcap")]
    for take in takes:
        arguments = ["track", str(clip), "--method", "hybrid", "--fps", "6", "-o", str(take)]
        subprocess.run(
            [sys.executable, "-P", "-m", "zenocap", *arguments], env=environment, check=True, capture_output=True
        )
    assert takes[0].read_bytes() == takes[1].read_bytes()
