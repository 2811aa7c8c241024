"""`zenocap export` to glTF and USD: names, rates, gaps, missing packages."""

from pathlib import Path

import numpy as np
import pygltflib
import pytest

import zenocap as zenocap_api
from tests.support.command import zenocap
from tests.tools.takes.test_export import needs_usd
from zenocap.common.errors import UserError
from zenocap.common.formats import export_format


def times(path: Path) -> list[float]:
    """Smallest and largest time and the number of keyframes of the animation."""
    file = pygltflib.GLTF2().load(str(path))
    accessor = file.accessors[file.animations[0].samplers[0].input]
    return [*accessor.min, *accessor.max, accessor.count]


@pytest.mark.slow
def test_glb_has_a_row_for_each_frame_from_the_first_one_on(two_view: Path, tmp_path: Path) -> None:
    status, out, err = zenocap("export", two_view, "-o", tmp_path / "a.glb")
    assert (status, out) == (0, f"{tmp_path / 'a.glb'}: 44 frames, 0 to 43, 30/s, m, y-up\n")
    assert err == "note: 7 frames without pose: last pose repeated\n"
    np.testing.assert_allclose(times(tmp_path / "a.glb"), [0, 43 / 30, 44], atol=1e-6)
    zenocap("export", two_view, "-o", tmp_path / "b.glb", "--from", "10", "--until", "20", "--fps", "60")
    np.testing.assert_allclose(times(tmp_path / "b.glb"), [0, 20 / 60, 21], atol=1e-6)


@pytest.mark.slow
def test_vrma_is_glb_with_another_suffix(two_view: Path, tmp_path: Path) -> None:
    for name in ("a.glb", "a.vrma"):
        assert zenocap("export", two_view, "-o", tmp_path / name, "--bones", "vrm")[0] == 0
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "a.vrma").read_bytes()
    names = {node.name for node in pygltflib.GLTF2().load(str(tmp_path / "a.glb")).nodes}
    assert {"hips", "leftUpperArm"} < names


@pytest.mark.slow
def test_one_pose_is_a_still(two_view: Path, tmp_path: Path) -> None:
    assert zenocap("export", two_view, "-o", tmp_path / "a.glb", "--from", "20", "--until", "20")[0] == 0
    assert times(tmp_path / "a.glb") == [0, 0, 1]


@pytest.mark.slow
@needs_usd
def test_usd_has_the_same_frames(two_view: Path, tmp_path: Path) -> None:
    from pxr import Usd

    status, out, err = zenocap("export", two_view, "-o", tmp_path / "a.usda")
    assert (status, out) == (0, f"{tmp_path / 'a.usda'}: 44 frames, 0 to 43, 30/s, m, y-up\n")
    assert err == "note: 7 frames without pose: last pose repeated, invisible\n"
    zenocap_api.open_take(two_view).export(tmp_path / "b.usdz", fps=60)
    stage = Usd.Stage.Open(str(tmp_path / "b.usdz"))
    assert (stage.GetTimeCodesPerSecond(), stage.GetEndTimeCode()) == (60, 86)


def test_a_missing_package_is_named(two_view: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(export_format, "find_spec", lambda name: None)
    for suffix, package, extra in ((".glb", "pygltflib", "gltf"), (".usd", "usd-core", "usd")):
        with pytest.raises(UserError, match=rf"needs the package {package}: .+ -m pip install 'zenocap\[{extra}\]'"):
            zenocap_api.open_take(two_view).export(tmp_path / f"a{suffix}")
