"""Rendered pictures equal stored ones within two grey levels."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.support.places import ROOT
from zenocap.common.formats.pose_track import Bound
from zenocap.tools.takes.render.camera_path import Shot
from zenocap.tools.takes.render.film import RenderOptions, render

TAKE = ROOT / "tests" / "golden" / "arms.mcap"
SIZE = (320, 240)
LEVELS = 2
OPTIONS = {
    "light": RenderOptions(first=Bound(60), size=SIZE, trails_s=1.0, poses=3),
    "dark": RenderOptions(first=Bound(60), size=SIZE, theme="dark", shot=Shot("front"), captions=False),
    "viewer": RenderOptions(first=Bound(60), size=SIZE, shot=Shot("1")),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", OPTIONS)
def test_a_picture_is_the_golden_one(name: str, tmp_path: Path) -> None:
    render(TAKE, tmp_path / "a.png", OPTIONS[name])
    found = cv2.imread(str(tmp_path / "a.png")).astype(int)
    expected = cv2.imread(str(Path(__file__).parent / f"golden-{name}.png")).astype(int)
    assert found.shape == expected.shape
    assert np.abs(found - expected).max() <= LEVELS
