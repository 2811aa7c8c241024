"""The table of sources: every row parses, opens and shows its texts; which texts belong to packages."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import pytest

from tests.common.rig.test_rig import RIG, write_rig
from zenocap.common import table as tables
from zenocap.common.rig.rig import load_rig
from zenocap.common.rig.source_kinds import SOURCES, SourceKind, parse_source
from zenocap.common.rig.sources import AdaptiveBackground, LiveSource, Source, SpecError
from zenocap.common.table import attribute

TEXTS = {
    "device": "/dev/v4l/by-id/usb-A-index0",
    "stream": "rtsp://me:secret@1.2.3.4/a",
    "video": "videos/a.mp4",
    "images": "images/*.png",
    "actor": "actor:walking?seed=3",
    "rendered": "rendered:a.npy?fps=59.94",
    "discover": "discover:lab/cam01",
}
LIVE = {"device", "stream"}
ENDS = {"video", "images", "actor", "rendered"}
FINISHES = {"video", "images"}  # in a live rig


@dataclass(frozen=True)
class Bag(LiveSource):
    name: str

    kind: ClassVar[str] = "bag"

    @property
    def text(self) -> str:
        return f"bag:{self.name}"


BAG = SourceKind("bag", "bag:NAME", lambda text, base: Bag(text.partition(":")[2]), "nowhere:opened")


@pytest.fixture
def bag(monkeypatch: pytest.MonkeyPatch) -> None:
    """A package brings the source `bag`, and one with the scheme of an own row."""
    found = {"bag": (f"{__name__}:BAG", "bags"), "rtsp": (f"{__name__}:BAG", "bags")}
    monkeypatch.setattr(tables, "_installed", lambda group: found if group == SOURCES.group else {})
    monkeypatch.setattr(SOURCES, "_rows", {})


@pytest.mark.parametrize("name", SOURCES.own)
def test_a_row_parses_its_texts_and_names_what_opens_them(name: str) -> None:
    row, source = SOURCES.row(name), parse_source(TEXTS[name], Path("/b"))
    assert callable(attribute(row.open))
    assert row.has(TEXTS[name])
    assert source.kind == name
    assert (source.live, source.ends, source.finishes) == (name in LIVE, name in ENDS, name in FINISHES)
    assert source.background == ("first:60" if name in ENDS else "adaptive")
    assert parse_source(source.text, Path("/")) == source
    assert "secret" not in source.shown


def test_a_text_belongs_to_one_address_and_files_are_what_is_left() -> None:
    for name, text in TEXTS.items():
        others = [row.name for row in SOURCES.rows().values() if row.has(text) and row.name not in ("images", "video")]
        assert others == ([] if name in ("images", "video") else [name])


@pytest.mark.usefixtures("bag")
def test_a_text_with_the_name_of_a_package_is_its_source() -> None:
    source: Source = parse_source("bag:monday", Path())
    assert source == Bag("monday")
    assert parse_source("Bag:monday", Path()) == source
    assert parse_source("rtsp://host/a", Path()).kind == "stream"
    assert parse_source("bag", Path()).kind == "video"
    with pytest.raises(SpecError, match=r"discover:MACHINE/CAMERA, bag:\.\.\., rtsp:\.\.\.$"):
        parse_source("ftp://host", Path())


@pytest.mark.usefixtures("bag")
def test_a_text_of_somebody_else_means_own_sources_only() -> None:
    assert parse_source("bag:monday", Path(), installed=False).kind == "video"
    with pytest.raises(SpecError, match=r"discover:MACHINE/CAMERA$"):
        parse_source("bag://monday", Path(), installed=False)


@pytest.mark.usefixtures("bag")
def test_a_viewer_treats_a_packages_source_as_its_type_says(tmp_path: Path) -> None:
    text = RIG.replace("source = 0", 'source = "bag:1"').replace('background = "first:60"\n', "").replace("fps = 15\n", "")
    viewer = load_rig(write_rig(tmp_path, text)).viewers[0]
    assert (viewer.source, viewer.background, viewer.fps) == (Bag("1"), AdaptiveBackground(), 30.0)
