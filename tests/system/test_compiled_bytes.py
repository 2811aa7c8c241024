"""Compiled and loaded kernels give equal bytes."""

from pathlib import Path

import pytest

from tests.support.places import CLIPS
from tests.support.processes import completed

pytestmark = [pytest.mark.nightly, pytest.mark.clips, pytest.mark.timeout(600)]


def test_take_is_equal_with_empty_and_with_full_compilation_cache(tmp_path: Path) -> None:
    """Fast-math flags that reorder sums or fuse operations break this: code is optimized with its callees or without."""
    clip = CLIPS / "walk7"
    takes = [tmp_path / name for name in ("empty.mcap", "full.mcap")]
    for take in takes:
        arguments = ["track", clip, "--method", "hybrid", "--fps", "6", "-o", take]
        done = completed(arguments, tmp_path, environment={"ZENOCAP_CACHE": str(tmp_path / "cache")})
        assert done.returncode == 0, done.stderr
    assert takes[0].read_bytes() == takes[1].read_bytes()
