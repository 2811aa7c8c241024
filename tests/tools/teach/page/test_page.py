"""The page of postures: chunks of poses that cannot be sent, labels that overlap among thousands."""

from itertools import combinations
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import pytest
from hypothesis import given
from hypothesis import strategies as st

from zenocap.common.rig.animator import PageTable
from zenocap.common.web.broadcast import PageQueue
from zenocap.services.recognizer.training.manifest import ManifestRow
from zenocap.tools.teach.page import messages as pm
from zenocap.tools.teach.page.labels import Label, overlaps
from zenocap.tools.teach.page.page import MOST_POSES, PosturePage


def test_chunks_beyond_the_end_and_more_than_a_page_receives_are_refused() -> None:
    take = SimpleNamespace(chunks=100, chunk=lambda number: bytes(4))
    page = PosturePage([take], lambda publish: Mock(), PageTable(port=0))  # type: ignore[list-item]
    queue = PageQueue()
    for take_number, chunk, reason in ((1, 0, "take 1: allowed: 0 to 0"), (0, 100, "chunk 100: allowed: 0 to 99")):
        with pytest.raises(ValueError, match=reason):
            page._send_poses(queue, pm.AskPoses(take_number, chunk))
    for chunk in range(MOST_POSES):
        assert page._send_poses(queue, pm.AskPoses(0, chunk))
    with pytest.raises(ValueError, match="too many poses wait"):
        page._send_poses(queue, pm.AskPoses(0, MOST_POSES))
    queue.waiting.clear()
    assert page._send_poses(queue, pm.AskPoses(0, MOST_POSES))


TIMES = st.none() | st.integers(0, 6).map(float)


@given(st.lists(st.tuples(st.sampled_from(["a.mcap", "b.mcap"]), TIMES, TIMES), max_size=8))
def test_overlapping_labels_share_time_in_one_take(rows: list[tuple[str, float | None, float | None]]) -> None:
    labels = [Label(k, ManifestRow(k, Path(row[0]), row[1], row[2], "wave", "me", "1")) for k, row in enumerate(rows)]

    def shared(one: ManifestRow, other: ManifestRow) -> bool:
        begin = max(one.start or 0.0, other.start or 0.0)
        ends = [row.end for row in (one, other) if row.end is not None]
        return one.source == other.source and begin < min(ends, default=begin + 1.0)

    expected = {frozenset((one.id, other.id)) for one, other in combinations(labels, 2) if shared(one.row, other.row)}
    found = [frozenset((one.id, other.id)) for one, other in overlaps(tuple(labels))]
    assert len(found) == len(set(found))
    assert set(found) == expected
