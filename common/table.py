"""Tables of what a user can choose: own rows, and those that installed packages bring as entry points."""

from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from typing import Generic, TypeVar

from zenocap.common.errors import UserError

Row = TypeVar("Row")


class Table(Generic[Row]):
    """Rows by name: own ones in their order, then those of installed packages, which cannot replace an own one.

    kind: type of a row.  group: of the entry points.  own: by name "module:attribute", imported when it is asked for.
    """

    def __init__(self, kind: type[Row], group: str, own: Mapping[str, str]) -> None:
        self.kind, self.group, self.own = kind, group, own
        self._rows: dict[str, Row] = {}

    def names(self) -> tuple[str, ...]:
        """Names of all rows, none of which is imported."""
        return (*self.own, *(name for name in _installed(self.group) if name not in self.own))

    def row(self, name: str) -> Row:
        """Row of that name.  Raises UserError for an unknown one, and for a package whose row cannot be imported."""
        if name not in self._rows:
            place, package = self._place(name)
            try:
                found = attribute(place)
            except (ImportError, AttributeError) as error:
                if not package:
                    raise
                raise UserError(f"{name!r} of the package {package}: {place} cannot be imported: {error}") from error
            if not isinstance(found, self.kind):
                raise UserError(f"{name!r} of the package {package}: {place} is no {self.kind.__name__}")
            self._rows[name] = found
        return self._rows[name]

    def first(self, fits: Callable[[Row], bool]) -> Row | None:
        """First row that fits; those of packages are imported only where no own one does.  Raises UserError."""
        own = next(filter(fits, map(self.row, self.own)), None)
        return next(filter(fits, self.rows().values()), None) if own is None else own

    def rows(self) -> Mapping[str, Row]:
        """All rows, imported.  Raises UserError."""
        return {name: self.row(name) for name in self.names()}

    def _place(self, name: str) -> tuple[str, str]:
        """Place of a row's definition, and its package, "" for this one."""
        installed = _installed(self.group) if name not in self.own else {}
        if name not in self.own and name not in installed:
            raise UserError(f"{name!r}: allowed: {', '.join(self.names())}")
        return (self.own[name], "") if name in self.own else installed[name]


def attribute(place: str) -> object:
    """Object at "module:attribute".  Raises ImportError and AttributeError."""
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)


@cache
def _installed(group: str) -> Mapping[str, tuple[str, str]]:
    """By name, place and package of the entry points of a group."""
    from importlib.metadata import entry_points  # takes longer than the rest of this module

    found = sorted(entry_points(group=group), key=lambda one: one.name)
    return {one.name: (one.value, one.dist.name if one.dist else "") for one in found}
