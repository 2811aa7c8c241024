"""TRC files: what is written is read again, and the shared scorer takes it."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.body.anatomy import TEN_PARTS
from common.formats.trc import FormatError, Trajectories, read_trc, write_trc

SCORER = Path(__file__).resolve().parents[2] / "shared" / "tools" / "score_trc.py"
NAMES = tuple(marker.name for marker in TEN_PARTS.markers)


def walking(count: int = 12, seed: int = 1) -> Trajectories:
    """Joint centres that move at random, the third frame without an estimate."""
    points = np.random.default_rng(seed).uniform(-1, 2, (count, len(NAMES), 3))
    points[2] = np.nan
    frames = np.arange(count, dtype=np.int64) + 5
    return Trajectories(NAMES, frames, frames / 30.0, points, 30.0)


def test_what_is_written_is_read_again(tmp_path: Path) -> None:
    data = walking()
    write_trc(tmp_path / "a.trc", data)
    again = read_trc(tmp_path / "a.trc")
    assert again.names == NAMES
    assert again.rate == 30.0
    np.testing.assert_array_equal(again.frames, data.frames)
    np.testing.assert_allclose(again.times_s, data.times_s, atol=1e-6)
    np.testing.assert_allclose(again.points, data.points, atol=1e-6)
    assert np.isnan(again.points[2]).all()


def test_millimetres_become_metres(tmp_path: Path) -> None:
    write_trc(tmp_path / "a.trc", walking())
    text = (tmp_path / "a.trc").read_text().replace("\tm\t", "\tmm\t")
    (tmp_path / "b.trc").write_text(text)
    np.testing.assert_allclose(read_trc(tmp_path / "b.trc").points, walking().points / 1000, atol=1e-6)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: "", "line 1"),
        (lambda text: text.replace("\tm\t", "\tfeet\t"), "Units = 'feet'"),
        (lambda text: text.replace("RHip", "LHip"), "line 4"),
        (lambda text: text.replace("\n5\t", "\nfive\t"), "line 7"),
        (lambda text: text.replace("30\t30\t", "x\tx\t"), "DataRate = 'x'"),
    ],
)
def test_what_is_no_trc_file_is_refused_by_line(tmp_path: Path, change: object, words: str) -> None:
    write_trc(tmp_path / "a.trc", walking())
    assert callable(change)
    (tmp_path / "b.trc").write_text(change((tmp_path / "a.trc").read_text()))
    with pytest.raises(FormatError, match=words):
        read_trc(tmp_path / "b.trc")


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"none\.trc: cannot be read"):
        read_trc(tmp_path / "none.trc")


@given(st.binary(max_size=300))
def test_no_bytes_do_worse_than_a_format_error(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.mktemp("trc") / "a.trc"
    path.write_bytes(b"PathFileType\t4\n" + data)
    with pytest.raises(FormatError):
        read_trc(path)


@pytest.mark.skipif(not SCORER.exists(), reason="the shared scorer is not beside the project")
def test_the_shared_scorer_takes_it(tmp_path: Path) -> None:
    write_trc(tmp_path / "a.trc", walking())
    command = [sys.executable, str(SCORER), str(tmp_path / "a.trc"), str(tmp_path / "a.trc"), "--json"]
    found = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert (found["joints"], found["frames"], found["mpjpe_mm"]) == (15, 11, 0.0)
