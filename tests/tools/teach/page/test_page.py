"""The page of postures: chunks of poses for a page that asks for too many, or for none that is there."""

from types import SimpleNamespace
from unittest.mock import Mock

import pytest

from zenocap.common.rig.animator import PageTable
from zenocap.common.web.broadcast import PageQueue
from zenocap.tools.teach.page import messages as pm
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
