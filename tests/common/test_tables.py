"""Tables of what a user can choose: own rows load; packages add rows, and replace none."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import zenocap
from tests.support.places import ROOT
from zenocap.common import table as tables
from zenocap.common.camera.calibration_layouts import LAYOUTS
from zenocap.common.errors import UserError
from zenocap.common.formats.export_format import FORMATS
from zenocap.common.formats.import_format import IMPORTS
from zenocap.common.rig.detectors import DETECTORS
from zenocap.common.rig.methods import METHODS
from zenocap.common.rig.outputs import OUTPUTS
from zenocap.common.rig.source_kinds import SOURCES
from zenocap.common.table import Table

TABLES = {
    one.group.removeprefix("zenocap."): one for one in (METHODS, SOURCES, FORMATS, IMPORTS, LAYOUTS, OUTPUTS, DETECTORS)
}


@pytest.fixture(params=TABLES.values(), ids=TABLES)
def table(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Table[object]]:
    """A table, and a package with rows for it: one named as an own row, a good one, and three that cannot be used."""
    found: Table[object] = request.param
    taken, place = next(iter(found.own.items()))
    rows = (f"{taken} = extra:TEXT", "za = extra:GOOD", "zb = extra:TEXT", "zc = extra:GONE", "zd = broken:ROW")
    (tmp_path / "more-1.0.dist-info").mkdir()
    for name, content in {
        "more-1.0.dist-info/METADATA": "Metadata-Version: 2.1\nName: more\nVersion: 1.0\n",
        "more-1.0.dist-info/entry_points.txt": "\n".join((f"[{found.group}]", *rows)),
        "extra.py": f"from zenocap.common.table import attribute\nGOOD, TEXT = attribute({place!r}), 'text'\n",
        "broken.py": "import a_module_that_is_not_there\n",
    }.items():
        (tmp_path / name).write_text(content)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(found, "_rows", {})
    tables._installed.cache_clear()
    yield found
    tables._installed.cache_clear()
    for name in ("extra", "broken"):
        sys.modules.pop(name, None)


def test_every_own_row_loads_and_has_its_name(table: Table[object]) -> None:
    for name in table.own:
        row = table.row(name)
        assert isinstance(row, table.kind)
        assert row.name == name  # type: ignore[attr-defined]


def test_a_package_adds_rows_after_the_own_ones_and_replaces_none(table: Table[object]) -> None:
    assert table.names() == (*table.own, "za", "zb", "zc", "zd")
    assert "extra" not in sys.modules
    own = tables.attribute(next(iter(table.own.values())))
    assert table.row(next(iter(table.own))) is table.row("za") is own


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("zb", "'zb' of the package more: extra:TEXT is no "),
        ("zc", "'zc' of the package more: extra:GONE cannot be imported: .*GONE"),
        ("zd", "'zd' of the package more: broken:ROW cannot be imported: .*not_there"),
        ("ze", "'ze': allowed: .*, za, zb, zc, zd$"),
    ],
)
def test_a_row_that_cannot_be_used_is_an_error_that_names_it(table: Table[object], name: str, text: str) -> None:
    with pytest.raises(UserError, match=text):
        table.row(name)


def test_a_broken_package_does_not_harm_what_is_found_among_own_rows(table: Table[object]) -> None:
    last = table.row(list(table.own)[-1])
    assert table.first(lambda row: row is last) is last


@pytest.mark.parametrize("one", TABLES.values(), ids=TABLES)
def test_a_row_type_is_public_and_on_the_page_on_extending(one: Table[object]) -> None:
    place = f"`{one.kind.__module__}.{one.kind.__name__}`"
    assert place in (zenocap.__doc__ or "")
    assert f"| `{one.group}` | {place} |" in (ROOT / "docs" / "extend.md").read_text(encoding="utf-8")
