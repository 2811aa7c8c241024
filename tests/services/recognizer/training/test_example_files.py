"""Examples of a manifest: takes, motion capture, all errors together."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.common.formats.test_motion_files import RATE, written
from tests.support.places import GOLDEN, MOTIONS
from zenocap.common.errors import UserError
from zenocap.common.formats.take_poses import read_poses
from zenocap.common.formats.trc import read_trc, write_trc
from zenocap.services.recognizer.features import NAMES, features_of
from zenocap.services.recognizer.motion_rows import ANGLES, WAY, WIDTH
from zenocap.services.recognizer.training.example_files import Features, examples_of, read_features, span
from zenocap.services.recognizer.training.manifest import ManifestRow

GOLDEN = GOLDEN / "arms.mcap"


@pytest.fixture
def raised(tmp_path: Path) -> Path:
    """Two seconds of a rising left arm, frames from 30 on."""
    return written(tmp_path, count=120, first=30)


def row(source: Path, start: float | None = None, end: float | None = None, line: int = 2) -> ManifestRow:
    return ManifestRow(line, source, start, end, "raise", "ann", "1")


def test_a_row_with_start_and_end_selects_that_part_of_a_trajectory_file(raised: Path) -> None:
    whole, part = examples_of(Path("m.csv"), [row(raised), row(raised, 1.0, 2.0, 3)], "directions")
    assert (whole.rate, whole.features.shape) == (RATE, (120, WIDTH))
    np.testing.assert_allclose(part.features, whole.features[30:91], atol=1e-9)
    rising = whole.features[:, NAMES.index("left_shoulder.z")]
    assert rising[-1] - rising[0] > 0.8
    assert (whole.label, whole.person, whole.repetition) == ("raise", "ann", "1")
    assert str(part) == f"m.csv: line 3: {raised} from 1 s to 2 s"


@pytest.mark.parametrize("kind", ["directions", "joint-angles"])
def test_a_take_has_the_features_of_its_own_angles(kind: str) -> None:
    track = read_poses(GOLDEN).track()
    found = read_features(GOLDEN, kind)
    assert found.rate == pytest.approx(track.rate)
    known = np.flatnonzero(track.known)
    at = track.frames[known]
    np.testing.assert_allclose(found.features[at, ANGLES], features_of(track.anatomy, track.angles[known], kind))
    np.testing.assert_allclose(found.features[at, WAY], track.positions[known][:, [0, 2]])
    assert np.isnan(np.delete(found.features, at, axis=0)).all()
    (example,) = examples_of(Path("m.csv"), [row(GOLDEN)], kind)
    assert len(example.features) == at[-1] - at[0] + 1


def test_all_unusable_examples_are_reported_together(raised: Path, tmp_path: Path) -> None:
    (tmp_path / "bad.bvh").write_text("HIERARCHY nonsense")
    (tmp_path / "bad.mcap").write_bytes(b"no take")
    bad = tmp_path / "bad.bvh"
    rows = [row(raised, 5.0, 6.0, 2), row(bad, line=3), row(bad, 1.0, 2.0, line=4), row(raised, 1.0, 1.01, 5)]
    rows.append(row(tmp_path / "bad.mcap", line=6))
    with pytest.raises(UserError) as failed:
        examples_of(tmp_path / "m.csv", rows, "directions")
    lines = str(failed.value).splitlines()
    assert len(lines) == 4
    assert "line 2" in lines[0]
    assert "from 5 s to 6 s: 0 frames: allowed: 2 or more, of 0.50 s to 2.48 s at 60/s" in lines[0]
    assert "line 3: " in lines[1]
    assert "bad.bvh" in lines[1]
    assert "1 frames: allowed: 2 or more" in lines[2]
    assert "bad.mcap" in lines[3]


def test_short_gaps_are_interpolated_and_error_names_long_ones_in_seconds_of_the_source() -> None:
    features = np.random.default_rng(0).normal(size=(100, 10))
    times_s = 3.0 + np.arange(100) / 20.0
    features[10:14] = np.nan
    features[50:60] = np.inf
    motion = Features(20.0, times_s, features)
    assert np.isfinite(span(motion, 3.0, 5.0)).all()
    with pytest.raises(ValueError, match=r"no angles from 5\.50 s to 6\.00 s: allowed: gaps of at most 0\.25 s"):
        span(motion, 4.0, 7.0)
    with pytest.raises(ValueError, match="no angles in any frame"):
        span(Features(20.0, times_s, np.full((100, 10), np.nan)), None, None)


def test_frames_before_the_first_pose_are_omitted_without_start_and_end() -> None:
    features = np.zeros((60, 10))
    features[:30] = np.nan
    assert len(span(Features(20.0, np.arange(60) / 20.0, features), None, None)) == 30


@pytest.mark.slow
@pytest.mark.clips
def test_motion_capture_data_have_all_features_after_their_rest_pose() -> None:
    (example,) = examples_of(Path("m.csv"), [row(MOTIONS / "cmu_07_03.bvh")], "directions")
    assert example.rate == 60.0
    assert np.isfinite(example.features).all()
    assert np.abs(np.diff(example.features, axis=0)).max() * example.rate < 30.0


@pytest.mark.slow
@pytest.mark.parametrize(("count", "more"), [(1, ""), (2, " and 1 more file"), (5, " and 4 more files")])
def test_equal_warnings_of_many_files_are_one_line_with_their_number(
    count: int, more: str, raised: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    found = read_trc(raised)
    turned = replace(found, points=found.points[:, :, [0, 2, 1]] * (1.0, -1.0, 1.0))  # Z up
    files = [tmp_path / f"turned-{k}.trc" for k in range(count)]
    for file in files:
        write_trc(file, turned)
    rows = [row(file, *span, line=2) for span in ((1.0, 2.0), (1.5, 2.5)) for file in (*files, raised)]
    assert len(examples_of(tmp_path / "m.csv", rows, "directions")) == len(rows)
    assert caplog.messages == [
        f"{files[0]}{more}: z is taken for up, as the person stands along it; otherwise: `up` in a joint map"
    ]
