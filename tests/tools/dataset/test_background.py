"""Everyday movement for the shipped model: rows without postures, the same for equal seeds."""

from pathlib import Path

import pytest

from zenocap.services.recognizer.training.examples import BACKGROUND
from zenocap.simulation.motion.activities import ACTIVITIES
from zenocap.simulation.motion.posture_style import POSTURES
from zenocap.tools.dataset.build_postures import REPETITIONS, background_rows, session_of


@pytest.mark.nightly
def test_rows_contain_every_activity_and_no_posture(tmp_path: Path) -> None:
    rows = list(background_rows(tmp_path, "truth", [9]))
    assert {row.posture for row in rows} == {BACKGROUND}
    assert all(row.source.is_file() for row in rows)
    segments = session_of(9).segments
    inside = [
        segment.name
        for segment in segments
        for row in rows
        if row.start is not None and row.end is not None
        if min(segment.end_s, row.end) - max(segment.start_s, row.start) > 1e-6
    ]
    assert not set(inside) & set(POSTURES)
    assert [inside.count(name) for name in ACTIVITIES] == [REPETITIONS] * len(ACTIVITIES)
    assert list(background_rows(tmp_path, "truth", [9])) == rows
