"""Every field of every message is read by a service, a tool or the page; unread fields are removed."""

import ast
import re
from collections.abc import Iterator

import msgspec
import pytest

from tests.support.places import ROOT
from zenocap.common import messages

READERS = ("common", "services", "tools", "zenocap")
STRUCTS = [one for one in vars(messages).values() if isinstance(one, type) and issubclass(one, msgspec.Struct)]


def names_read() -> Iterator[str]:
    """Attributes that are read in Python, and properties in the scripts of the page."""
    for folder in READERS:
        for path in sorted((ROOT / folder).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text())):
                if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Load):
                    yield node.attr
                elif isinstance(node, ast.MatchClass):
                    yield from node.kwd_attrs
    for path in sorted((ROOT / "services" / "animator" / "page").rglob("*.js")):
        yield from re.findall(r"\.(\w+)", path.read_text())


@pytest.fixture(scope="module")
def read() -> frozenset[str]:
    return frozenset(names_read())


@pytest.mark.slow
@pytest.mark.parametrize("struct", STRUCTS, ids=lambda struct: struct.__name__)
def test_every_field_has_a_reader(struct: type[msgspec.Struct], read: frozenset[str]) -> None:
    assert set(struct.__struct_fields__) <= read


@pytest.mark.slow
def test_unread_name_is_found(read: frozenset[str]) -> None:
    assert "no_field_of_any_message" not in read
