"""Guided set-up from standard input: left, continued, and a first take."""

from pathlib import Path

import pytest

from tests.support.person_films import walker_film
from tests.support.processes import run
from zenocap.common.bus.zenoh_session import free_ports

pytestmark = pytest.mark.nightly  # a first take of a few seconds, in which a busy machine may have no pose


def setup(folder: Path, answers: str, *options: str) -> tuple[int, str]:
    """Status and output of `zenocap setup studio`."""
    return run(folder, "setup", "studio", *options, answers=answers)


def test_a_set_up_is_left_and_taken_up_again(tmp_path: Path) -> None:
    walker_film(tmp_path / "films")
    videos = [f"{name}=films/videos/{name}.mp4" for name in ("cam01", "cam02")]
    status, text = setup(tmp_path, "", *videos[:1])
    assert status == 1
    assert "1 camera(s): cam01: allowed: two or more" in text
    status, text = setup(tmp_path, "n\n", *videos, "--size", "320x240", "--fps", "15")
    assert status == 1
    assert "Step 3 of 5" in text
    assert "left: the same command goes on here" in text
    assert setup(tmp_path, "", "--status")[0] == 3
    status, text = setup(tmp_path, "", "--again", "take")
    assert status == 1
    assert "calibration is not done" in text
    status, text = setup(tmp_path, "", *videos)
    assert status == 1
    assert "cameras.toml: exists already" in text
    (port,) = free_ports(1)
    status, text = setup(tmp_path, "q\nf\nnothing.toml\nknown.toml\n")
    assert "q: allowed: b, w, f" in text
    assert "nothing.toml: no such file" in text
    assert "Step 5 of 5" in text
    rig = tmp_path / "studio" / "rig.toml"
    rig.write_text(rig.read_text(encoding="utf-8") + f"\n[animator.page]\nport = {port}\n", encoding="utf-8")
    status, text = setup(tmp_path, "\n", "--seconds", "12")
    assert status == 0, text
    assert "verdict" in text
    assert "zenocap show studio/recordings/" in text
    assert setup(tmp_path, "", "--status")[0] == 0
