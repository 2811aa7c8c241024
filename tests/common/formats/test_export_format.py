"""Table of export formats: every row writes, suffixes are unique."""

from collections import Counter

import pytest

from tests.support.places import GOLDEN
from zenocap.common.errors import UserError
from zenocap.common.formats.export_format import FORMATS, format_of
from zenocap.common.table import attribute
from zenocap.tools.takes.export import ExportOptions, export


@pytest.mark.parametrize("name", FORMATS.names())
def test_a_row_names_what_writes_it(name: str) -> None:
    row = FORMATS.row(name)
    assert row.name == name
    assert callable(attribute(row.write))
    assert row.unit in (row.units or (row.unit,))
    assert row.suffixes or row.model


def test_a_suffix_belongs_to_one_format() -> None:
    suffixes = Counter(suffix for row in FORMATS.rows().values() for suffix in row.suffixes)
    assert max(suffixes.values()) == 1
    assert {format_of(suffix.upper()) for suffix in suffixes} == {row for row in FORMATS.rows().values() if row.suffixes}
    assert format_of(".fbx") is None


def test_an_unknown_format_is_an_error_with_the_allowed_ones() -> None:
    with pytest.raises(UserError, match="'fbx': allowed: trc, bvh, "):
        export(GOLDEN / "arms.mcap", GOLDEN / "arms.fbx", ExportOptions("fbx"))
