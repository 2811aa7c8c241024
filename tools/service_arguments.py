"""Options of commands that open a session, and of services: read, and written into a command line."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Literal

import typer

from zenocap.common.errors import UserError
from zenocap.tools.option_groups import option

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from collections.abc import Mapping

    from zenocap.common.bus.security import Security
    from zenocap.common.bus.zenoh_session import ZenohOptions
    from zenocap.common.rig.rig import Rig
    from zenocap.common.rig.services import ServiceKey

PANEL = "Zenoh (overrides the rig file)"
Mode = Literal["peer", "client", "router"]


@dataclass(frozen=True)
class ConnectArguments:
    """How a process reaches a network, under the names that Zenoh's own tools use."""

    PANEL: ClassVar[str] = PANEL

    connect: list[str] | None = option(
        None, "Endpoint to connect to, such as tcp/192.168.1.2:7447; may be repeated.", "-e", "--connect",
        metavar="ENDPOINT",
    )  # fmt: skip
    config: Path | None = option(None, "Zenoh configuration file (JSON5).", "-c", "--config", metavar="FILE")


@dataclass(frozen=True)
class RouterArguments(ConnectArguments):
    """The options of a router, whose mode is given."""

    listen: list[str] | None = option(
        None, "Endpoint to listen on, such as tcp/0.0.0.0:7447; may be repeated.", "-l", "--listen", metavar="ENDPOINT"
    )
    no_multicast_scouting: bool = option(False, "Disable discovery by multicast; use endpoints only.")

    def router_options(self, secured: Security | None) -> ZenohOptions:
        """Session options of a router.  Raises UserError."""
        return replace(ZenohArguments(**vars(self), mode="router").options(), security=secured)


@dataclass(frozen=True)
class ZenohArguments(RouterArguments):
    """The options of a command that joins a rig's network."""

    mode: Mode | None = option(None, "Session mode; a peer connects to others directly.", "-m", "--mode")

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
            self.mode or _mode(table.mode), tuple(self.connect or table.connect), tuple(self.listen or table.listen),
            self.config or (rig.base / table.config if table.config else None),
            table.multicast_scouting and not self.no_multicast_scouting, security([rig], member),
        )  # fmt: skip

    def words(self) -> list[str]:
        """The options that differ from their defaults, as words of a command line."""
        found: list[str] = []
        for field in fields(self):
            name, value = f"--{field.name.replace('_', '-')}", getattr(self, field.name)
            if value is True:
                found.append(name)
            elif value != field.default:
                found += [word for one in (value if isinstance(value, list) else [value]) for word in (name, str(one))]
        return found


@dataclass(frozen=True)
class ServiceArguments(ZenohArguments):
    """The options of every service; one more of them is a field here, and its effect in `running`.

    with_parent: whether the service ends when its standard input is closed.
    """

    with_parent: bool = option(False, "", hidden=True)

    @contextmanager
    def running(self, name: str) -> Iterator[Callable[[], bool]]:
        """Run the enclosed service; the value says whether it is to stop.  name: of the service in its log lines.

        One that is stopped while it waits for a router has done its work.
        """
        from zenocap.common.bus.protocol import BusError
        from zenocap.common.runtime import logs
        from zenocap.common.runtime.signals import print_stacks_on_signal, stop_signals, watched

        logs.configure(name)
        print_stacks_on_signal()
        with stop_signals(with_parent=self.with_parent) as stopped, watched():
            try:
                yield stopped
            except BusError as error:
                if not stopped():
                    raise
                logging.getLogger(__name__).info("%s", error)
                raise typer.Exit(0) from None


def arguments_of(options: ZenohOptions) -> ServiceArguments:
    """The arguments of a service that a process starts, and that ends with it."""
    return ServiceArguments(
        connect=list(options.connect), config=options.config_file, listen=list(options.listen),
        no_multicast_scouting=not options.multicast_scouting, mode=options.mode, with_parent=True,
    )  # fmt: skip


def words(service: ServiceKey, rig: Path | None, arguments: ZenohArguments, *own: str) -> list[str]:
    """Command line of a service.  rig: as its argument, None without one.  own: options that only this service has."""
    name, id = service
    which = [] if rig is None else [str(rig), *(["--id", id] if name == "viewer" else [])]
    return [sys.executable, "-P", "-m", "zenocap", name, *which, *own, *arguments.words()]


def security(rigs: list[Rig], member: str, generations: Mapping[str, int] | None = None) -> Security | None:
    """The certificates of `member` for the rigs; None where they are not secured.  generations: see `security_of`.

    Raises UserError.
    """
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
