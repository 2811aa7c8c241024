"""Rows of installed packages, without a package."""

from collections.abc import Mapping

import pytest

from zenocap.common import table as tables
from zenocap.common.table import Row, Table


def add_row(monkeypatch: pytest.MonkeyPatch, table: Table[Row], name: str, row: Row | None) -> None:
    """Let a table have the row of a package named `more`; None: one that cannot be imported."""
    installed = tables._installed

    def with_row(group: str) -> Mapping[str, tuple[str, str]]:
        return {**installed(group), **({name: ("gone:ROW", "more")} if group == table.group else {})}

    monkeypatch.setattr(tables, "_installed", with_row)
    if row is not None:
        monkeypatch.setitem(table._rows, name, row)
