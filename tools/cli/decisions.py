"""Options with which the user decides where zenocap would guess: the cameras in use, and front and back at the start."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import typer

PANEL = "Decisions"


@dataclass(frozen=True)
class Decisions:
    """cameras: text with commas.  front: camera, or heading: degrees; at most one of them."""

    cameras: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,NAME...",
            help="Use these cameras only, such as cam01,cam03; two or more. Default: all.",
            rich_help_panel=PANEL,
        ),
    ] = None
    front: Annotated[
        str | None,
        typer.Option(
            metavar="CAMERA",
            help="Camera that the person faces at the start, where front and back are exchanged without it.",
            rich_help_panel=PANEL,
        ),
    ] = None
    heading: Annotated[
        float | None,
        typer.Option(
            min=-360,
            max=360,
            metavar="DEGREES",
            help="Direction of the person's front at the start: 0 along +Z of the world, 90 along +X. Not with --front.",
            rich_help_panel=PANEL,
        ),
    ] = None

    def names(self) -> list[str] | None:
        """Names of the cameras in use; None: all."""
        return camera_list(self.cameras)


def camera_list(text: str | None) -> list[str] | None:
    """Names of cameras in a text with commas; None: all."""
    return None if text is None else [name for part in text.split(",") if (name := part.strip())]
