"""Errors of generated takes: those of the true poses are small, and a take without poses is lost."""

from pathlib import Path

import numpy as np
import pytest
from benchmarks.errors import summary

from benchmarks.recognition.take_errors import take_errors
from benchmarks.table import table
from zenocap.tools.dataset.batch import PostureTake, generate_takes, take_path

TAKE = PostureTake(5, "raise-right-arm", 0)


@pytest.mark.slow
def test_true_poses_have_small_errors(tmp_path: Path) -> None:
    generate_takes(tmp_path, "truth", [TAKE], 1, lambda *_: None)
    errors = take_errors(take_path(tmp_path, "truth", TAKE), TAKE)
    assert len(errors) > 30
    assert max(np.median(error.segments) for error in errors) < 1.0
    _, segments, _, joints, yaw, lost, _ = summary(errors)
    assert segments < 1.0
    assert joints < 30.0  # the truth has more parts than the take's body
    assert yaw < 1.0
    assert lost == 0.0


def test_a_take_without_poses_is_lost(tmp_path: Path) -> None:
    assert all(error.lost for error in take_errors(take_path(tmp_path, "truth", TAKE), TAKE))


def test_tables_are_markdown() -> None:
    assert table("Title", ("what", "mm"), [("a", 1.0), ("longer", 22)]).splitlines() == [
        "",
        "**Title**",
        "",
        "| what   |   mm |",
        "|--------|-----:|",
        "| a      | 1.00 |",
        "| longer |   22 |",
    ]
