"""`zenocap export` to glTF and USD: names, rates, gaps, errors."""

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pygltflib
import pytest

import zenocap as zenocap_api
from tests.common.formats.test_take_poses import messages_of_track, write_take
from tests.support.command import zenocap
from tests.support.pose_tracks import moving
from tests.tools.takes.test_export import FIRST
from zenocap.common.errors import UserError
from zenocap.common.formats import export_format

needs_usd = pytest.mark.skipif(find_spec("pxr") is None, reason="usd-core is not installed: pip install 'zenocap[usd]'")


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Path:
    messages = messages_of_track(moving(30, first=FIRST, lost=(7, 8), rate=30.0))
    return write_take(tmp_path_factory.mktemp("takes") / "take.mcap", messages)


def times(path: Path) -> list[float]:
    """Smallest and largest time and the number of keyframes of the animation."""
    file = pygltflib.GLTF2().load(str(path))
    accessor = file.accessors[file.animations[0].samplers[0].input]
    return [*accessor.min, *accessor.max, accessor.count]


@pytest.mark.slow
def test_glb_has_a_row_for_each_frame_from_the_first_one_on(take: Path, tmp_path: Path) -> None:
    status, out, err = zenocap("export", take, "-o", tmp_path / "a.glb")
    assert (status, out) == (0, f"{tmp_path / 'a.glb'}: 34 frames, 0 to 33, 30/s, m, y-up\n")
    assert err == "note: 6 frames without pose: last pose repeated\n"
    np.testing.assert_allclose(times(tmp_path / "a.glb"), [0, 33 / 30, 34], atol=1e-6)
    zenocap("export", take, "-o", tmp_path / "b.glb", "--from", "10", "--until", "20", "--fps", "60")
    np.testing.assert_allclose(times(tmp_path / "b.glb"), [0, 20 / 60, 21], atol=1e-6)


@pytest.mark.slow
def test_vrma_is_glb_with_another_suffix(take: Path, tmp_path: Path) -> None:
    for name in ("a.glb", "a.vrma"):
        assert zenocap("export", take, "-o", tmp_path / name, "--bones", "vrm")[0] == 0
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "a.vrma").read_bytes()
    names = {node.name for node in pygltflib.GLTF2().load(str(tmp_path / "a.glb")).nodes}
    assert {"hips", "leftUpperArm"} < names


@pytest.mark.slow
def test_one_pose_is_a_still(take: Path, tmp_path: Path) -> None:
    assert zenocap("export", take, "-o", tmp_path / "a.glb", "--from", "20", "--until", "20")[0] == 0
    assert times(tmp_path / "a.glb") == [0, 0, 1]


@pytest.mark.slow
@needs_usd
def test_usd_has_the_same_frames(take: Path, tmp_path: Path) -> None:
    from pxr import Usd

    status, out, err = zenocap("export", take, "-o", tmp_path / "a.usda")
    assert (status, out) == (0, f"{tmp_path / 'a.usda'}: 34 frames, 0 to 33, 30/s, m, y-up\n")
    assert err == "note: 6 frames without pose: last pose repeated, invisible\n"
    zenocap_api.open_take(take).export(tmp_path / "b.usdz", fps=60)
    stage = Usd.Stage.Open(str(tmp_path / "b.usdz"))
    assert (stage.GetTimeCodesPerSecond(), stage.GetEndTimeCode()) == (60, 66)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".glb", pytest.param(".usda", marks=needs_usd), pytest.param(".usdz", marks=needs_usd)])
def test_a_place_that_cannot_be_written_is_one_line(suffix: str, take: Path) -> None:
    status, _, text = zenocap("export", take, "-o", f"/proc/a{suffix}")
    assert (status, text.count("\n")) == (1, 1)
    assert f"/proc/a{suffix}: cannot be written" in text


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (("-o", "a.glb", "--units", "cm"), "a.glb: units cm, axes y-up: allowed in glb: units m, axes y-up"),
        (("-o", "a.glb", "--axes", "unity"), "a.glb: units m, axes unity: allowed in glb: units m, axes y-up"),
        (("-o", "a.mot", "--axes", "z-up"), "axes z-up: allowed in mot: units m, axes y-up, opensim"),
        (("-o", "a.mot", "--units", "mm"), "units mm, axes y-up: allowed in mot: units m, axes y-up, opensim"),
        (("-o", "a.bvh", "--bones", "vrm"), "a.bvh: bones vrm: allowed in glb, usd"),
        (("-o", "a.glb", "--joints", "coco"), "a.glb: joints coco: glb has no points: allowed in trc, c3d, csv"),
        (("-o", "a.x", "--to", "usd"), "a.x: suffix '.x': allowed in usd: .usd, .usda, .usdc, .usdz"),
        (("-o", "a.glb", "--from", "11", "--until", "12"), "the person is lost in every frame: no pose to hold"),
    ],
)
def test_a_wrong_input_is_one_line(
    arguments: tuple[str, ...], error: str, take: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    status, _, text = zenocap("export", take, *arguments)
    assert (status, text.count("\n")) == (1, 1)
    assert error in text
    assert list(tmp_path.iterdir()) == []


def test_a_missing_package_is_named(take: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(export_format, "find_spec", lambda name: None)
    for suffix, package, extra in ((".glb", "pygltflib", "gltf"), (".usd", "usd-core", "usd")):
        with pytest.raises(UserError, match=rf"needs the package {package}: pip install 'zenocap\[{extra}\]'"):
            zenocap_api.open_take(take).export(tmp_path / f"a{suffix}")


def test_a_take_without_poses_is_refused(tmp_path: Path) -> None:
    empty = write_take(tmp_path / "empty.mcap", messages_of_track(moving(3, lost=(0, 1, 2))))
    status, _, text = zenocap("export", empty, "-o", tmp_path / "a.glb")
    assert (status, text.count("\n")) == (1, 1)
    assert not (tmp_path / "a.glb").exists()
