"""Selection of keys by Zenoh key expressions.  Pure.

`*` stands for one part of a key, `**` for any number of parts, and `*` within a part for any letters (Zenoh writes `$*`).
An expression that does not begin with `zenocap/` or `**` is relative to a rig: `viewer/**` is `zenocap/*/viewer/**`.
"""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache

ROOT = "zenocap"
# Topics about the recording itself; replayed only when an expression ends with their name.
INTERNAL = ("handled", "verdict")


@dataclass(frozen=True)
class ReplaySelection:
    """Selection of keys.  topics: key expressions to replay, empty for all.  exclude: key expressions to leave out."""

    topics: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Raises ValueError for an invalid key expression."""
        for option, expressions in (("--topics", self.topics), ("--exclude", self.exclude)):
            for expression in expressions:
                try:
                    _pattern(expression)
                except ValueError as error:
                    raise ValueError(f"{option} {expression!r}: {error}") from None

    def takes(self, key: str) -> bool:
        last = key.rpartition("/")[2]
        if last in INTERNAL and not any(expression.rpartition("/")[2] == last for expression in self.topics):
            return False
        return (not self.topics or _any(self.topics, key)) and not _any(self.exclude, key)

    def of(self, keys: Iterable[str]) -> list[str]:
        return [key for key in keys if self.takes(key)]


def full(expression: str) -> str:
    return expression if expression.startswith((f"{ROOT}/", "**")) else f"{ROOT}/*/{expression}"


def _any(expressions: Sequence[str], key: str) -> bool:
    return any(_pattern(expression).fullmatch(key) for expression in expressions)


@cache
def _pattern(expression: str) -> re.Pattern[str]:
    parts = full(expression).split("/")
    if not all(parts):
        raise ValueError("a key expression has no empty part, such as 'viewer/**' or 'zenocap/*/integrator/bap'")
    if any(mark in expression for mark in "#?"):
        raise ValueError("'#' and '?' have no place in a key expression; '*' is any part, '**' any number of them")
    text = ""
    for number, part in enumerate(parts):
        if part == "**":
            text += "(?:[^/]+(?:/[^/]+)*)?" if number == 0 else "(?:/[^/]+)*"
        else:
            text += ("/" if number else "") + _part(part)
    # A leading "**" may match no part: then the key begins with the part after it.
    return re.compile(text if parts[0] != "**" else text.replace(")?/", "/)?", 1))


def _part(part: str) -> str:
    if part == "*":
        return "[^/]+"
    return "[^/]*".join(re.escape(piece) for piece in part.replace("$*", "*").split("*"))
