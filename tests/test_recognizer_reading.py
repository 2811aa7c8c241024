"""Examples of a manifest's rows: of takes in their own anatomy, of motion capture, with everything wrong said at once."""

from pathlib import Path

import numpy as np
import pytest

from common.body.anatomy import TEN_PARTS
from common.body.definition import Pose
from common.body.kinematics import joint_centres
from common.formats.poses import read_poses
from common.formats.trc import Trajectories, write_trc
from services.recognizer.features import NAMES, features_of
from services.recognizer.manifest import ManifestError, Row
from services.recognizer.reading import Features, examples_of, features_in, stretch
from tests.test_from_centres import body

GOLDEN = Path(__file__).parent / "golden" / "arms.mcap"
MOTIONS = Path(__file__).resolve().parents[2] / "shared" / "motions"
RATE = 60.0


@pytest.fixture
def raised(tmp_path: Path) -> Path:
    """Two seconds of a left arm that goes up, frames from 30 on."""
    points = []
    for share in np.linspace(0, 1, 120):
        angles = TEN_PARTS.neutral.copy()
        angles[TEN_PARTS.index["left_shoulder.z"]] += 1.2 * share
        points.append(joint_centres(TEN_PARTS, body(TEN_PARTS), Pose(np.array([0.0, 1.0, 0.0]), angles)))
    frames = np.arange(30, 150, dtype=np.int64)
    names = tuple(marker.name for marker in TEN_PARTS.markers)
    write_trc(tmp_path / "raise.trc", Trajectories(names, frames, frames / RATE, np.array(points), RATE))
    return tmp_path / "raise.trc"


def row(source: Path, start: float | None = None, end: float | None = None, line: int = 2) -> Row:
    return Row(line, source, start, end, "raise", "ann", "1")


def test_a_stretch_of_trajectories_is_what_its_time_column_says(raised: Path) -> None:
    whole, part = examples_of(Path("m.csv"), [row(raised), row(raised, 1.0, 2.0, 3)], "directions")
    assert (whole.rate, whole.features.shape) == (RATE, (120, len(NAMES)))
    np.testing.assert_allclose(part.features, whole.features[30:91], atol=1e-9)
    rising = whole.features[:, NAMES.index("left_shoulder.z")]
    assert rising[-1] - rising[0] > 0.8
    assert (whole.label, whole.person, whole.repetition) == ("raise", "ann", "1")
    assert str(part) == f"m.csv: line 3: {raised} from 1 s to 2 s"


@pytest.mark.parametrize("kind", ["directions", "joint-angles"])
def test_a_take_has_the_features_of_its_own_angles(kind: str) -> None:
    track = read_poses(GOLDEN).track()
    chosen = "joint-angles" if kind == "joint-angles" else "directions"
    found = features_in(GOLDEN, chosen)
    assert found.rate == pytest.approx(track.rate)
    known = np.flatnonzero(track.known)
    at = track.frames[known]
    np.testing.assert_allclose(found.features[at], features_of(track.anatomy, track.angles[known], chosen))
    assert np.isnan(np.delete(found.features, at, axis=0)).all()
    (example,) = examples_of(Path("m.csv"), [row(GOLDEN)], chosen)
    assert len(example.features) == at[-1] - at[0] + 1


def test_everything_that_cannot_be_used_is_said_at_once(raised: Path, tmp_path: Path) -> None:
    (tmp_path / "bad.bvh").write_text("HIERARCHY nonsense")
    (tmp_path / "bad.mcap").write_bytes(b"no take")
    rows = [
        row(raised, 5.0, 6.0, 2),
        row(tmp_path / "bad.bvh", line=3),
        row(tmp_path / "bad.bvh", 1.0, 2.0, line=4),
        row(raised, 1.0, 1.01, 5),
        row(tmp_path / "bad.mcap", line=6),
    ]
    with pytest.raises(ManifestError) as failed:
        examples_of(tmp_path / "m.csv", rows, "directions")
    lines = str(failed.value).splitlines()
    assert len(lines) == 4
    assert "line 2" in lines[0]
    assert "from 5 s to 6 s: 0 frames: allowed: 2 or more, of 0.50 s to 2.48 s at 60/s" in lines[0]
    assert "line 3: " in lines[1]
    assert "bad.bvh" in lines[1]
    assert "1 frames: allowed: 2 or more" in lines[2]
    assert "bad.mcap" in lines[3]


def test_short_gaps_are_bridged_and_long_ones_are_named_in_seconds_of_the_source() -> None:
    features = np.random.default_rng(0).normal(size=(100, 10))
    times_s = 3.0 + np.arange(100) / 20.0
    features[10:14] = np.nan
    features[50:60] = np.nan
    motion = Features(20.0, times_s, features)
    assert np.isfinite(stretch(motion, 3.0, 5.0)).all()
    with pytest.raises(ValueError, match=r"no angles from 5\.50 s to 6\.00 s: allowed: gaps of at most 0\.25 s"):
        stretch(motion, 4.0, 7.0)
    with pytest.raises(ValueError, match="no angles in any frame"):
        stretch(Features(20.0, times_s, np.full((100, 10), np.nan)), None, None)


def test_without_start_and_end_what_comes_before_the_first_pose_is_left_out() -> None:
    features = np.zeros((60, 10))
    features[:30] = np.nan
    assert len(stretch(Features(20.0, np.arange(60) / 20.0, features), None, None)) == 30


@pytest.mark.clips
@pytest.mark.skipif(not MOTIONS.is_dir(), reason="the shared motions are not beside the project")
def test_motion_capture_without_its_rest_pose_has_all_its_features() -> None:
    (example,) = examples_of(Path("m.csv"), [row(MOTIONS / "cmu_07_03.bvh")], "directions")
    assert example.rate == 60.0
    assert np.isfinite(example.features).all()
    assert np.abs(np.diff(example.features, axis=0)).max() * example.rate < 30.0
