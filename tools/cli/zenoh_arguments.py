"""Zenoh's own command-line options, declared once for every command that opens a session."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from collections.abc import Mapping

    from zenocap.common.bus.security import Security
    from zenocap.common.bus.zenoh_session import ZenohOptions
    from zenocap.common.rig.rig import Rig

PANEL = "Zenoh (overrides the rig file)"

Mode = Literal["peer", "client", "router"]
ModeOption = Annotated[
    Mode | None,
    typer.Option("-m", "--mode", help="Session mode; a peer connects to others directly.", rich_help_panel=PANEL),
]
ConnectOption = Annotated[
    list[str] | None,
    typer.Option(
        "-e",
        "--connect",
        metavar="ENDPOINT",
        help="Endpoint to connect to, such as tcp/192.168.1.2:7447; may be repeated.",
        rich_help_panel=PANEL,
    ),
]
ListenOption = Annotated[
    list[str] | None,
    typer.Option(
        "-l",
        "--listen",
        metavar="ENDPOINT",
        help="Endpoint to listen on, such as tcp/0.0.0.0:7447; may be repeated.",
        rich_help_panel=PANEL,
    ),
]
ConfigOption = Annotated[
    Path | None,
    typer.Option("-c", "--config", metavar="FILE", help="Zenoh configuration file (JSON5).", rich_help_panel=PANEL),
]
NoMulticastOption = Annotated[
    bool,
    typer.Option(
        "--no-multicast-scouting", help="Disable discovery by multicast; use endpoints only.", rich_help_panel=PANEL
    ),
]


@dataclass(frozen=True)
class ZenohArguments:
    """The options of a command that joins a rig's network, under the names that Zenoh's own tools use."""

    mode: ModeOption = None
    connect: ConnectOption = None
    listen: ListenOption = None
    config: ConfigOption = None
    no_multicast_scouting: NoMulticastOption = False

    def options(self, rig: Rig | None = None, member: str = "reader") -> ZenohOptions:
        """Session options: the command line's, else those of the rig file's zenoh table.

        member: name of the certificate to use where the rig is secured.  Raises UserError.
        """
        from zenocap.common.bus.zenoh_session import ZenohOptions

        if rig is None:
            multicast = not self.no_multicast_scouting
            return ZenohOptions(self.mode, tuple(self.connect or ()), tuple(self.listen or ()), self.config, multicast)
        table = rig.zenoh
        return ZenohOptions(
            self.mode or _mode(table.mode),
            tuple(self.connect or table.connect),
            tuple(self.listen or table.listen),
            self.config or (rig.base / table.config if table.config else None),
            table.multicast_scouting and not self.no_multicast_scouting,
            security([rig], member),
        )


@dataclass(frozen=True)
class RouterArguments:
    """The options of a router, whose mode is given."""

    connect: ConnectOption = None
    listen: ListenOption = None
    config: ConfigOption = None
    no_multicast_scouting: NoMulticastOption = False

    def options(self, secured: Security | None) -> ZenohOptions:
        arguments = ZenohArguments("router", self.connect, self.listen, self.config, self.no_multicast_scouting)
        return replace(arguments.options(), security=secured)


def security(rigs: list[Rig], member: str, generations: Mapping[str, int] | None = None) -> Security | None:
    """The certificates of `member` for the rigs; None where they are not secured.  generations: see `security_of`.

    Raises UserError.
    """
    from zenocap.common.errors import UserError
    from zenocap.common.rig.security import security_of

    try:
        return security_of(rigs, member, generations)
    except ValueError as error:
        raise UserError(str(error)) from error


def _mode(text: str) -> Mode:
    match text:
        case "client" | "router":
            return text
        case _:
            return "peer"
