"""Delays of the cameras of a take, and the key of the rig file that corrects them."""

from pathlib import Path

import pytest

from tests.tools.judge.test_view_lag import messages
from zenocap.common.errors import UserError
from zenocap.tools.judge.evidence import evidence_of
from zenocap.tools.setup.sync.take import delays_of, lines_of, rig_lines

TAKE = Path("a.mcap")


@pytest.mark.slow
@pytest.mark.parametrize("late_s", [0.012, 0.04, 0.2, -0.5])
def test_the_camera_with_the_older_images_has_the_delay(late_s: float) -> None:
    found = delays_of(evidence_of(messages({"cam01": 0.0, "cam02": -late_s})), TAKE)
    assert not found.uncertain
    late, prompt = ("cam02", "cam01") if late_s > 0 else ("cam01", "cam02")
    assert found.delays_ms[late] == pytest.approx(1e3 * abs(late_s), abs=8.0)
    assert found.delays_ms[prompt] == 0.0
    assert any(line.startswith("delay_ms = ") and line.endswith(late) for line in rig_lines(found))
    assert any(line.startswith(f"{late}: ") and "ms late" in line for line in lines_of(found))


@pytest.mark.slow
def test_cameras_that_see_no_movement_are_not_certain() -> None:
    found = delays_of(evidence_of(messages({"cam01": 0.0, "cam02": 0.2}, still=True)), TAKE)
    assert found.uncertain
    assert any("not certain" in line for line in lines_of(found))


def test_a_take_of_one_view_is_refused() -> None:
    with pytest.raises(UserError, match=r"a.mcap: silhouettes of a person in 1 view\(s\): allowed: two or more"):
        delays_of(evidence_of(messages({"cam01": 0.0})), TAKE)
