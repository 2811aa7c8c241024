"""`--from` and `--until`: the part of a take that a command works on, declared once."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import typer

from zenocap.tools.option_groups import option

if TYPE_CHECKING:  # imported where it is used: `zenocap --help` answers at once
    from zenocap.common.formats.pose_track import Bound


@dataclass(frozen=True)
class FrameRange:
    """The options `--from` and `--until`: frame numbers, or seconds since frame 0; both ends belong to the range."""

    first: str | None = option(
        None, "First frame, such as 120, or its time, such as 2.5s.", "--from", metavar="FRAME|TIMEs"
    )
    last: str | None = option(None, "Last frame (inclusive), or its time.", "--until", metavar="FRAME|TIMEs")

    def bounds(self) -> tuple[Bound | None, Bound | None]:
        """First and last; None for an end that is not given.  Raises typer.BadParameter."""
        return bound("--from", self.first), bound("--until", self.last)


def bound(option: str, text: str | None) -> Bound | None:
    """Parse a frame number, or seconds with "s"; None stays None.  Raises typer.BadParameter."""
    from zenocap.common.formats.pose_track import Bound

    if text is None:
        return None
    found = re.fullmatch(r"(\d{1,12})|(\d{1,9}(?:\.\d{0,9})?)s", text)
    if not found:
        raise typer.BadParameter(f"{option} {text!r}: allowed: a frame number such as 120, or seconds such as 2.5s")
    return Bound(float(found[1]) if found[1] else float(found[2]), found[1] is None)
