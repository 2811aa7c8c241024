"""All tables of what a user can choose: own rows load and have their names; packages add rows, and replace none."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

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
    """A table, and a package that brings it a row of an own name, and one whose module cannot be imported."""
    found: Table[object] = request.param
    taken = next(iter(found.own))
    info = tmp_path / "broken-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: broken\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{found.group}]\n{taken} = broken:ROW\nzz = broken:ROW\n")
    (tmp_path / "broken.py").write_text("import a_module_that_is_not_there\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(found, "_rows", {})
    tables._installed.cache_clear()
    yield found
    tables._installed.cache_clear()
    sys.modules.pop("broken", None)


def test_every_own_row_loads_and_has_its_name(table: Table[object]) -> None:
    for name in table.own:
        row = table.row(name)
        assert isinstance(row, table.kind)
        assert row.name == name  # type: ignore[attr-defined]


def test_a_package_adds_a_row_and_replaces_none(table: Table[object]) -> None:
    assert table.names() == (*table.own, "zz")
    taken = next(iter(table.own))
    assert table.row(taken) is tables.attribute(table.own[taken])


def test_a_package_that_cannot_be_imported_is_named_when_its_row_is_asked_for(table: Table[object]) -> None:
    with pytest.raises(UserError, match=r"'zz' of the package broken: broken:ROW cannot be imported: .*not_there"):
        table.row("zz")


def test_a_broken_package_does_not_harm_what_is_found_among_own_rows(table: Table[object]) -> None:
    last = table.row(list(table.own)[-1])
    assert table.first(lambda row: row is last) is last
