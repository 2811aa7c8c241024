"""`zenocap prior train` and `zenocap prior info`."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.support.command import printed, refused, zenocap
from tests.support.places import MOTIONS
from tests.support.prior_cases import gait
from zenocap.common.body.anatomy import FOURTEEN_PARTS, Anatomy
from zenocap.common.formats.joint_map import JointMap
from zenocap.services.tracker.prior import motions
from zenocap.services.tracker.prior.file import read_prior
from zenocap.services.tracker.prior.sequences import TrainingMotion
from zenocap.tools.cli.prior import parsed_frames


@pytest.fixture
def walks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Files of a synthetic gait; real files are covered by the tests of their reader."""
    paths = [tmp_path / f"walk{k}.bvh" for k in range(2)]
    for path in paths:
        path.touch()

    def read(path: Path, anatomy: Anatomy, frames: range | None = None, joints: JointMap | None = None) -> TrainingMotion:
        assert anatomy is FOURTEEN_PARTS
        poses = gait(240, int(path.stem[-1]))
        return TrainingMotion(path.stem, 60.0, poses if frames is None else poses[frames.start : frames.stop])

    monkeypatch.setattr(motions, "read_motion", read)
    return paths


@pytest.mark.slow
def test_train_writes_a_prior_and_prints_the_error_by_regions(walks: list[Path], tmp_path: Path) -> None:
    out, figure = tmp_path / "walk.prior", tmp_path / "errors.png"
    text = printed("prior", "train", *walks, "-o", out, "--plot", figure)
    prior = read_prior(out, FOURTEEN_PARTS)
    assert prior.training.motions == ("walk0", "walk1")
    rows = [line.split() for line in text.splitlines() if line.strip()[:1].isdigit()]
    assert [int(row[0]) for row in rows] == [row.regions for row in prior.training.errors]
    assert float(rows[0][2].rstrip("°")) == pytest.approx(np.degrees(prior.training.errors[0].held), abs=0.006)
    assert figure.read_bytes().startswith(b"\x89PNG")


@pytest.mark.nightly
def test_equal_seeds_give_equal_bytes_and_info_prints_the_same_summary(walks: list[Path], tmp_path: Path) -> None:
    one, other = tmp_path / "one.prior", tmp_path / "other.prior"
    _, output, _ = zenocap("prior", "train", *walks, "-o", one, "--regions", 6, "--json")
    printed("prior", "train", *walks, "-o", other, "--regions", 6)
    assert one.read_bytes() == other.read_bytes()
    found = json.loads(printed("prior", "info", one, "--json"))
    assert found == json.loads(output)
    assert found["regions"] == 6


@pytest.mark.slow
def test_held_out_files_and_frames_follow_the_options(walks: list[Path], tmp_path: Path) -> None:
    out = tmp_path / "walk.prior"
    options = ("--held", walks[1], "--frames", "0-99", "--no-mirror", "--regions", 20)
    assert "held out    walk1" in printed("prior", "train", walks[0], *options, "-o", out)
    training = read_prior(out).training
    assert (training.frames, training.mirrored, training.held) == (100, False, ("walk1",))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("train nowhere.bvh -o x.prior", "error: nowhere.bvh: there is no such file"),
        ("train walk0.bvh -o nowhere/x.prior", "there is no folder nowhere"),
        ("train walk0.bvh -o x.prior --plot x.gif", "suffix '.gif': allowed: .png, .jpg, .pdf, .svg"),
        ("train walk0.bvh -o x.prior --frames 0-9", "training frames: allowed: 25 or more"),
        ("info nowhere", "prior = 'nowhere': no file nowhere; allowed: a file, or a name of: "),
        ("info walk0.bvh", "walk0.bvh: begins with b'': allowed"),
    ],
)
def test_invalid_input_is_a_one_line_error(
    walks: list[Path], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, arguments: str, words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    assert words in refused("prior", *arguments.split())
    assert not (tmp_path / "x.prior").exists()


@pytest.mark.slow
@pytest.mark.parametrize("text", ["", "9-0", "5", "5-5", "a-b", "-1-4"])
def test_invalid_frame_range_is_wrong_usage(text: str) -> None:
    assert "--frames" in printed("prior", "train", "x.bvh", "-o", "x.prior", "--frames", text, status=2)


def test_frame_range_includes_its_last_frame() -> None:
    assert parsed_frames("0-99") == range(100)


@pytest.mark.nightly
@pytest.mark.clips
def test_a_prior_of_recorded_walks_reconstructs_another_persons_walk(tmp_path: Path) -> None:
    files = [MOTIONS / f"cmu_07_0{k}.bvh" for k in (1, 2, 3)]
    out = tmp_path / "walk.prior"
    status, _, errors = zenocap("prior", "train", *files, "--held", MOTIONS / "cmu_02_01.bvh", "-o", out)
    assert status == 0
    assert all(line.startswith("learning: ") for line in errors.splitlines())  # progress, after 10 s
    prior = read_prior(out, FOURTEEN_PARTS)
    assert min(np.degrees(row.training) for row in prior.training.errors) < 2.0
    assert min(np.degrees(row.held) for row in prior.training.errors) < 12.0
