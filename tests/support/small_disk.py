"""A disk that is soon full: a tmpfs of a few kilobytes, where this user may mount one."""

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest


@contextmanager
def small_disk(folder: Path, kilobytes: int) -> Iterator[Path]:
    """Mount it at `folder`, and unmount it at the end; skips the test where this is not allowed."""
    with mounted(folder, kilobytes) as disk:
        if disk is None:
            pytest.skip("no tmpfs can be mounted")
        yield disk


@contextmanager
def mounted(folder: Path, kilobytes: int) -> Iterator[Path | None]:
    """The same; None where this user may not mount one."""
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "zenocap-test", str(folder)]
    try:
        subprocess.run(command, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        yield None
        return
    try:
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=False)
