"""The public interface: `zenocap.track`, `open_take`, `Rig.load`; arrays agree with the exports."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import zenocap
from tests.support.person_films import small_film
from tests.support.places import CLIPS, GOLDEN, ROOT
from zenocap.common.formats.take_poses import read_poses
from zenocap.common.rig.rig import demo_rig_file

ARMS = GOLDEN / "arms.mcap"


def test_all_public_names_are_accessible_and_documented() -> None:
    for name in zenocap.__all__:
        assert getattr(zenocap, name).__doc__, name
    assert set(zenocap.__all__) <= set(dir(zenocap))
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        zenocap.nothing  # noqa: B018


def test_importing_the_package_loads_no_heavy_modules() -> None:
    code = "import sys, zenocap; print(sorted({'numpy', 'numba', 'cv2', 'zenoh', 'scipy'} & set(sys.modules)))"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"


@pytest.mark.slow
def test_the_package_is_found_beside_a_folder_of_its_name(tmp_path: Path) -> None:
    """Where a user's clone, named zenocap, lies in the current folder.  Installed as `make` does, by a path."""
    (tmp_path / "zenocap").symlink_to(ROOT)
    found = subprocess.run(
        [sys.executable, "-c", "import zenocap; print(zenocap.__file__)"],
        cwd=tmp_path, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert Path(found.stdout.strip()).samefile(zenocap.__file__ or "")


def test_takes_and_poses_are_shown_in_one_line() -> None:
    take = zenocap.open_take(ARMS)
    assert repr(take) == f"<Take {str(ARMS)!r}: {take.frame_count} poses, 15 frames/s>"
    poses = take.poses()
    end = f"{poses.times_s[-1]:.2f} s, 0 lost>"
    assert repr(poses).startswith(f"<Poses: {len(poses)} of {len(take.joint_names)} joints, frames {poses.frames[0]} to ")
    assert repr(poses).endswith(end)
    assert "\n" not in repr(poses) + repr(take)


def test_a_take_has_the_arrays_of_its_export() -> None:
    take = zenocap.open_take(ARMS)
    poses, track = take.poses(), read_poses(ARMS).track()
    np.testing.assert_array_equal(poses.joint_centres, track.trajectories().points)
    np.testing.assert_array_equal(poses.frames, track.frames)
    np.testing.assert_array_equal(poses.times_s, track.times_s)
    np.testing.assert_array_equal(poses.positions, track.positions)
    np.testing.assert_array_equal(poses.angles, track.angles)
    assert take.rate == pytest.approx(track.rate)
    assert take.joint_names == track.trajectories().names
    assert (len(poses), take.missing) == (take.frame_count, None)


@pytest.mark.parametrize("size", [1, 7, 10_000])
def test_chunks_together_equal_the_take(size: int) -> None:
    take = zenocap.open_take(ARMS)
    whole, parts = take.poses(), list(take.chunks(size))
    assert max(map(len, parts)) == min(size, len(whole))
    np.testing.assert_array_equal(np.concatenate([part.frames for part in parts]), whole.frames)
    np.testing.assert_array_equal(np.concatenate([part.joint_centres for part in parts]), whole.joint_centres)


def test_chunk_size_below_one_is_rejected() -> None:
    with pytest.raises(ValueError, match="size = 0: allowed: 1 or more"):
        next(zenocap.open_take(ARMS).chunks(0))


@pytest.mark.parametrize("content", [b"", b"no take at all"])
def test_file_that_is_not_a_take_is_a_user_error(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "x.mcap"
    path.write_bytes(content)
    with pytest.raises(zenocap.UserError, match=r"x\.mcap"):
        zenocap.open_take(path)
    with pytest.raises(zenocap.UserError, match=r"none\.mcap"):
        zenocap.open_take(tmp_path / "none.mcap")


def test_truncated_take_gives_its_intact_poses(tmp_path: Path) -> None:
    path = tmp_path / "cut.mcap"
    data = ARMS.read_bytes()
    path.write_bytes(data[: int(len(data) * 0.7)])
    take = zenocap.open_take(path)
    assert take.missing is not None
    assert "cut before its end" in take.missing
    assert 0 < len(take.poses()) < len(zenocap.open_take(ARMS).poses())


def test_the_suffix_chooses_the_format(tmp_path: Path) -> None:
    take = zenocap.open_take(ARMS)
    assert take.export(tmp_path / "a.trc").rows == take.frame_count
    with pytest.raises(zenocap.UserError, match=r"a.fbx: suffix '.fbx': allowed: .trc, .bvh, .c3d, .csv"):
        take.export(tmp_path / "a.fbx")


def test_a_rig_is_loaded_and_a_wrong_one_is_a_user_error(tmp_path: Path) -> None:
    rig = zenocap.demo_rig("two-view")
    assert zenocap.Rig.load(rig.files[0]).name == rig.name == "demo"
    with pytest.raises(zenocap.UserError, match="no such rig"):
        zenocap.Rig.load(tmp_path / "none.toml")


def test_a_list_of_videos_needs_a_calibration(tmp_path: Path) -> None:
    with pytest.raises(zenocap.UserError, match="calibration is missing"):
        zenocap.track([tmp_path / "a.mp4"], tmp_path / "a.mcap")
    with pytest.raises(zenocap.UserError, match=r"a\.mp4: no such file"):
        zenocap.track([tmp_path / "a.mp4"], tmp_path / "a.mcap", calibration=tmp_path / "c.toml")
    with pytest.raises(zenocap.UserError, match="allowed with a list of videos"):
        zenocap.track(zenocap.demo_rig("two-view"), tmp_path / "a.mcap", calibration=tmp_path / "c.toml")
    with pytest.raises(zenocap.UserError, match="method and variant: allowed with files or a folder"):
        zenocap.track(zenocap.demo_rig("two-view"), tmp_path / "a.mcap", variant="paper")
    with pytest.raises(zenocap.UserError, match=r"variant = 'printed': allowed: improved, paper"):
        zenocap.track(demo_rig_file("two-view"), tmp_path / "a.mcap", variant="printed")
    with pytest.raises(zenocap.UserError, match=r"method = 'two-view' has no tracker"):
        zenocap.track(zenocap.demo_rig("two-view"), tmp_path / "a.mcap", preset="paper")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("clip", "empty_frames"),
    [
        pytest.param(None, 14, id="simulated", marks=pytest.mark.slow),
        pytest.param(CLIPS / "walk2", 30, id="walk2", marks=[pytest.mark.nightly, pytest.mark.clips]),
    ],
)
def test_a_list_of_videos_gives_the_poses_of_their_folder(clip: Path | None, empty_frames: int, tmp_path: Path) -> None:
    clip = clip or small_film(tmp_path / "small")
    seen: list[int] = []
    folder = zenocap.track(clip, tmp_path / "folder.mcap", progress=seen.append)
    assert seen == list(range(1, seen[-1] + 1))
    assert folder.frame_count > 20
    videos = sorted((clip / "videos").iterdir())
    listed = zenocap.track(
        videos, tmp_path / "list.mcap", calibration=clip / "calibration.toml", up_axis="y", empty_frames=empty_frames
    )
    np.testing.assert_array_equal(listed.poses().joint_centres, folder.poses().joint_centres)


@pytest.mark.slow
def test_a_take_has_a_verdict_in_words() -> None:
    verdict = zenocap.open_take(ARMS).verdict
    assert verdict.text.splitlines()[0].startswith(f"verdict: {verdict.rating}")
