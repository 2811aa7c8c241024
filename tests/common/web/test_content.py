"""Saved files that pages can get: at paths that cannot be guessed, with the token of the page."""

from pathlib import Path

import pytest

from tests.common.web.test_server import TOKEN, fetched
from tests.support.animator_stand_in import stand_in
from zenocap.common.web import content
from zenocap.common.web.content import OfferedFiles
from zenocap.common.web.parameters import MAX_OFFERED


def test_the_latest_files_are_offered(tmp_path: Path) -> None:
    offered, paths = OfferedFiles(), []
    for number in range(MAX_OFFERED + 1):
        (tmp_path / f"{number}.bvh").write_text("x")
        paths.append(offered.offer(tmp_path / f"{number}.bvh"))
    assert len(set(paths)) == len(paths)
    assert offered.read(paths[0]) is None
    found = offered.read(paths[-1])
    assert found is not None
    assert found[1]["Content-Disposition"].endswith(f"''{MAX_OFFERED}.bvh")
    assert offered.read("/saved/../0.bvh") is None
    (tmp_path / f"{MAX_OFFERED}.bvh").unlink()
    assert offered.read(paths[-1]) is None


def test_a_large_file_is_not_offered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(content, "MAX_OFFERED_BYTES", 3)
    (tmp_path / "a.mp4").write_text("1234")
    assert OfferedFiles().offer(tmp_path / "a.mp4") == ""


def test_a_file_is_sent_with_its_name_only_with_the_token(tmp_path: Path) -> None:
    (tmp_path / "my walk ö.bvh").write_bytes(b"HIERARCHY")
    with stand_in(tmp_path, token=TOKEN) as animator:
        assert animator.bridge._feed is not None
        path = animator.bridge._feed.page.offered.offer(tmp_path / "my walk ö.bvh").lstrip("/")
        base, _, query = animator.address.partition("?")
        status, headers, body = fetched(f"{base}{path}?{query}")
        assert (status, body) == (200, b"HIERARCHY")
        assert headers["Content-Disposition"] == "attachment; filename*=UTF-8''my%20walk%20%C3%B6.bvh"
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert fetched(f"{base}{path}")[0] == 403
        assert fetched(f"{base}saved/other?{query}")[0] == 404
