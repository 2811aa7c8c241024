"""Where two messages differ, field by field."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import isclose

import msgspec

from common.messages import Message

MOST = 20  # fields that are named
ABSENT = "nothing"


@dataclass(frozen=True)
class Difference:
    """A recomputed message that is not the logged one.  fields: "path: logged ..., recomputed ...", at most MOST."""

    key: str
    frame: int
    captured_ns: int
    fields: tuple[str, ...]


def difference(key: str, logged: Message, recomputed: Message, tolerance: float = 0.0) -> Difference | None:
    """None when every field is equal; numbers may differ by `tolerance`, relative or absolute, whichever is larger."""
    found = tuple(_differing("", msgspec.to_builtins(logged), msgspec.to_builtins(recomputed), tolerance))
    if not found:
        return None
    more = (f"... and {len(found) - MOST} more fields",) if len(found) > MOST else ()
    return Difference(key, logged.frame, logged.captured_ns, (*found[:MOST], *more))


def _differing(path: str, logged: object, recomputed: object, tolerance: float) -> Iterator[str]:
    match logged, recomputed:
        case dict(), dict():
            for name in dict.fromkeys([*logged, *recomputed]):
                inner = f"{path}.{name}" if path else str(name)
                yield from _differing(inner, logged.get(name, ABSENT), recomputed.get(name, ABSENT), tolerance)
        case list() | tuple(), list() | tuple() if len(logged) == len(recomputed):
            for k, (one, other) in enumerate(zip(logged, recomputed, strict=True)):
                yield from _differing(f"{path}[{k}]", one, other, tolerance)
        case float(), float() if tolerance and isclose(logged, recomputed, rel_tol=tolerance, abs_tol=tolerance):
            return
        case _ if logged != recomputed:
            yield f"{path}: logged {logged!r}, recomputed {recomputed!r}"
