"""Errors of TOML tables: texts that name the key, its value and the allowed values."""

import re
from collections.abc import Mapping
from pathlib import Path

import msgspec

from zenocap.common.errors import UserError, did_you_mean


class TableError(UserError):
    """The text begins with the key in its table, and contains its value and the allowed values."""


def shipped_or_own(key: str, text: str, base: Path, shipped: Path, suffix: str, *, must_exist: bool) -> Path:
    """Path of the file of that name in the folder `shipped` of the package, or else of the file relative to `base`.

    must_exist: raise TableError when there is neither.  ./NAME selects a file with the name of a shipped one.
    """
    included, own = shipped / f"{text}{suffix}", base / text
    if "/" not in text and included.is_file():
        return included
    if must_exist and not own.is_file():
        names = ", ".join(sorted(path.stem for path in shipped.glob(f"*{suffix}"))) or "none included in this version"
        raise TableError(f"{key} = {text!r}: no file {own}; allowed: a file, or a name of: {names}")
    return own


def choice_problem(key: str, value: str, allowed: tuple[str, ...]) -> str:
    """Text for a value that is not one of the allowed words."""
    values = ", ".join(repr(word) for word in allowed) or "none"
    return f"{key} = {value!r}: allowed: {values}{did_you_mean(value, allowed)}"


def unknown_key(where: str, table: object, kind: type[msgspec.Struct], more: tuple[str, ...] = ()) -> str | None:
    """Text for the first key of `table` that `kind` does not have; None without one.

    where: key of the table, "" for the file.  more: further allowed keys.
    """
    if not isinstance(table, dict):
        return None
    known = (*more, *kind.__struct_fields__)
    for key, value in table.items():
        if key not in known:
            return no_such_key(where, key, value, known)
    return None


def no_such_key(where: str, key: str, value: object, known: tuple[str, ...]) -> str:
    """Text for an unknown key of the table `where`, "" for the file."""
    full = f"{where}.{key}" if where else key
    return f"{full} = {value!r}: no such key; allowed: {', '.join(known)}{did_you_mean(key, known)}"


def invalid_value(tables: Mapping[str, object], text: str, where: str = "") -> str:
    """Text from msgspec's message (such as "Expected `float` <= 1000 - at `$.viewer[0].fps`"), with the value.

    where: key of `tables` in the file, "" for the file.
    """
    found = re.fullmatch(r"(.*?)(?: - at `\$\.?(.*)`)?", text, re.DOTALL)
    message, key = (found[1], found[2] or "") if found else (text, "")
    prefix = f"{where}." if where else ""
    if missing := re.fullmatch(r"Object missing required field `(.*)`", message):
        return f"{prefix}{key + '.' if key else ''}{missing[1]} is missing"
    value: object = tables
    for step in re.findall(r"\w+", key):
        if isinstance(value, dict):
            value = value.get(step)
        elif isinstance(value, list) and step.isdecimal() and int(step) < len(value):
            value = value[int(step)]
    expected = re.sub(r",? (?:but )?got .*", "", message.removeprefix("Expected ")).replace("`", "")
    return f"{prefix}{key} = {value!r}: allowed: {expected.replace('array', 'list')}"
