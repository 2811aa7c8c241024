"""Tables of choices: own rows, rows of installed packages, unusable ones."""

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from zenocap.common import table as tables
from zenocap.common.errors import UserError
from zenocap.common.table import Table

GROUP = "zenocap.test"


@dataclass(frozen=True)
class Lens:
    name: str


OWN = Lens("own")
OWN_ROWS = {"own": f"{__name__}:OWN"}


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A package that brings rows: a good one, one of another type, one that is not there, and one named as an own row."""
    info = tmp_path / "lenses-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: lenses\nVersion: 1.0\n")
    lines = ("wide = lenses:WIDE", "text = lenses:TEXT", "gone = lenses:GONE", "own = lenses:WIDE")
    (info / "entry_points.txt").write_text("\n".join([f"[{GROUP}]", *lines]))
    (tmp_path / "lenses.py").write_text(f"from {__name__} import Lens\nWIDE = Lens('wide')\nTEXT = 'wide'\n")
    monkeypatch.syspath_prepend(tmp_path)
    tables._installed.cache_clear()
    yield
    tables._installed.cache_clear()
    sys.modules.pop("lenses", None)


def lenses() -> Table[Lens]:
    return Table(Lens, GROUP, OWN_ROWS)


@pytest.mark.usefixtures("installed")
def test_a_row_of_an_installed_package_stands_after_the_own_ones() -> None:
    assert lenses().names() == ("own", "gone", "text", "wide")
    assert "lenses" not in sys.modules
    assert lenses().row("wide") == Lens("wide")


@pytest.mark.usefixtures("installed")
def test_a_package_cannot_replace_an_own_row() -> None:
    assert lenses().row("own") is OWN


def test_an_unknown_name_is_an_error_with_the_allowed_ones() -> None:
    with pytest.raises(UserError, match="'wide': allowed: own"):
        lenses().row("wide")


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize(("name", "why"), [("text", "is no Lens"), ("gone", "cannot be imported: .*GONE")])
def test_a_row_that_cannot_be_used_names_its_package(name: str, why: str) -> None:
    with pytest.raises(UserError, match=f"'{name}' of the package lenses: lenses:{name.upper()} {why}"):
        lenses().row(name)
