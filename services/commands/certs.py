"""The command that makes certificates: certs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from services.commands.options import RigPath, one_line_errors, rig_at

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from common.bus.access import Member
    from common.runtime.rig import Rig


def certs(
    rig: RigPath,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="The folder; default: the rig's own, else certs beside it."),
    ] = None,
    host: Annotated[
        list[str] | None,
        typer.Option(
            "--host",
            metavar="NAME=HOST",
            help="A name or address that NAME is called by, such as router=192.168.1.10; may be repeated.",
        ),
    ] = None,
    service: Annotated[
        list[str] | None,
        typer.Option("--service", metavar="NAME", help="Only this one, such as viewer-1, or replay; may be repeated."),
    ] = None,
    days: Annotated[int, typer.Option("--days", min=1, max=3650, help="How long they are valid.")] = 730,
    renew: Annotated[bool, typer.Option("--renew", help="Make those anew that are there.")] = False,
) -> None:
    """An authority of your own, and a certificate for each service of a rig, its router, and who reads or records.

    Run it once, on one machine, and copy to each machine what it says. What is there is kept, so run it again when a viewer
    is added. The hosts in the rig's `connect` are the router's, or without one the integrator's.

    Example: `zenocap certs studio.toml --host router=192.168.1.10`
    """
    from datetime import UTC, datetime

    from rich.console import Console

    from common.runtime.rig import RigError
    from common.runtime.security import needed_members

    with one_line_errors():
        from services.certificates.folder import certify
        from services.certificates.report import report

        one = rig_at(rig, files=False)
        folder = output or one.security or one.base / "certs"
        members = _chosen(one, service or ()) if service else needed_members(one)
        wanted = _hosts(one, members, host or ())
        made = certify(folder, one.name, wanted, datetime.now(UTC), days, renew=renew)
        if not made:
            raise RigError("nobody to make a certificate for")
    Console().print(report(one.name, rig, folder, made, secured=one.security is not None), soft_wrap=True)


def _chosen(rig: Rig, names: list[str] | tuple[str, ...]) -> tuple[Member, ...]:
    """The members of these names.  Raises RigError."""
    from common.bus.access import ROUTER, Member
    from common.runtime.rig import RigError
    from common.runtime.security import allowed_members

    known = {member.name: member for member in (*allowed_members(rig), Member(ROUTER))}
    for name in names:
        if name not in known:
            raise RigError(f"--service {name}: allowed: {', '.join(known)}")
    return tuple(known[name] for name in dict.fromkeys(names))


def _hosts(rig: Rig, members: tuple[Member, ...], options: list[str] | tuple[str, ...]) -> dict[Member, tuple[str, ...]]:
    """What each member is called by: this machine's own names, the rig's endpoints, and the options.  Raises RigError."""
    from common.bus.access import ROUTER
    from common.runtime.rig import RigError
    from common.runtime.security import host_of

    called = ROUTER if rig.zenoh.mode == "client" else "integrator"
    hosts = {member.name: ["localhost", "127.0.0.1", "::1"] for member in members}
    for endpoint in rig.zenoh.connect:
        hosts.get(called, []).append(host_of(endpoint))
    for option in options:
        name, equals, host = option.partition("=")
        if not equals or not host or name not in hosts:
            raise RigError(f"--host {option}: allowed: NAME=HOST, NAME one of {', '.join(hosts)}")
        hosts[name].append(host)
    return {member: tuple(dict.fromkeys(hosts[member.name])) for member in members}
