"""Warm-up parts in processes by duration; nothing compiled in vain."""

import io
from pathlib import Path

import pytest
from rich.console import Console
from typer.testing import CliRunner

from tests.support.command import app
from zenocap.tools.operate.warmup.parts import PARTS
from zenocap.tools.operate.warmup.processes import WEIGHTS, compile_parts, shared_out


def test_every_part_is_in_one_group() -> None:
    groups = shared_out(tuple(PARTS), 2)
    assert sorted(part for group in groups for part in group) == sorted(PARTS)
    assert WEIGHTS.keys() <= PARTS.keys()


def test_longest_part_gets_its_own_process() -> None:
    assert shared_out(("silhouettes", "actor", "tracking"), 2) == [["tracking"], ["silhouettes", "actor"]]
    assert shared_out(("tracker",), 2) == [["tracker"]]


def test_a_cache_that_cannot_be_written_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("ZENOCAP_CACHE", str(tmp_path / "file"))
    words = f"the cache {tmp_path / 'file'} cannot be written: allowed: ZENOCAP_CACHE = "
    shown = io.StringIO()
    assert compile_parts(("tracker",), lambda: False, Console(file=shown, width=1000))
    assert f"warning: {words}" in shown.getvalue()
    found = CliRunner().invoke(app, ["warmup"], env={"COLUMNS": "1000"})
    assert found.exit_code == 1
    assert words in found.output
