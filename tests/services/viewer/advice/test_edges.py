"""Widths of edges and motion blur."""

import numpy as np
import pytest

from zenocap.services.viewer.advice.edges import Blur, blur_percent, room_edge_px, widths_of


@pytest.mark.parametrize("width", [2, 4, 6])
def test_width_of_a_ramp(width: int) -> None:
    x = np.arange(-12, 13)
    profile = 100.0 * np.clip((x + width / 2) / width, 0.0, 1.0)
    assert widths_of(profile[None])[0] == pytest.approx(width, rel=0.05)


def test_faint_edges_have_no_width() -> None:
    assert np.isnan(widths_of(np.linspace(0.0, 10.0, 21)[None])[0])


def test_a_plain_room_has_no_edge() -> None:
    assert room_edge_px(np.full((120, 160, 3), 90.0, np.float32)) is None


@pytest.mark.parametrize("share", [0.0, 0.3, 0.8])
def test_blur_is_the_exposed_share_of_the_motion(share: float) -> None:
    moved = np.concatenate([np.zeros(60), np.full(60, 10.0)])
    found = blur_percent([Blur(moved, 1.5 + share * moved, 200.0)])
    assert found == pytest.approx(100.0 * share * 10.0 / 200.0)


def test_blur_of_a_still_person_is_unknown() -> None:
    assert blur_percent([]) is None
    assert blur_percent([Blur(np.zeros(200), np.full(200, 2.0), 200.0)]) is None
