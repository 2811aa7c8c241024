"""The command that makes certificates: certs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.tools.cli.options import RigPath, one_line_errors, rig_at

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.bus.access import Member
    from zenocap.common.rig.rig import Rig


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
            help="Host name or address of the member NAME, such as router=192.168.1.10; may be repeated.",
        ),
    ] = None,
    service: Annotated[
        list[str] | None,
        typer.Option("--service", metavar="NAME", help="Only this member, such as viewer-1 or replay; may be repeated."),
    ] = None,
    days: Annotated[int, typer.Option("--days", min=1, max=3650, help="Validity (days).")] = 730,
    renew: Annotated[bool, typer.Option("--renew", help="Replace existing certificates and keys.")] = False,
) -> None:
    """Create a certificate authority and certificates for the services, router, readers and recorders of a rig.

    Run it once on one machine and copy the listed files to each machine. Existing files are kept: run it again when a
    viewer is added. The hosts in the rig's `connect` belong to the router, or without a router to the integrator.

    Example: `zenocap certs studio.toml --host router=192.168.1.10`
    """
    from datetime import UTC, datetime

    from rich.console import Console

    from zenocap.common.errors import UserError
    from zenocap.common.rig.security import needed_members

    with one_line_errors():
        from zenocap.tools.certificates.folder import certify
        from zenocap.tools.certificates.report import report

        one = rig_at(rig, files=False)
        folder = output or one.security or one.base / "certs"
        members = _chosen(one, service or ()) if service else needed_members(one)
        hosts_of_members = _hosts(one, members, host or ())
        made = certify(folder, one.name, hosts_of_members, datetime.now(UTC), days, renew=renew)
        if not made:
            raise UserError("no member to create a certificate for")
    Console().print(report(one.name, rig, folder, made, secured=one.security is not None), soft_wrap=True)


def _chosen(rig: Rig, names: list[str] | tuple[str, ...]) -> tuple[Member, ...]:
    """The members of these names.  Raises UserError."""
    from zenocap.common.bus.access import ROUTER, Member
    from zenocap.common.errors import UserError
    from zenocap.common.rig.security import allowed_members

    known = {member.name: member for member in (*allowed_members(rig), Member(ROUTER))}
    for name in names:
        if name not in known:
            raise UserError(f"--service {name}: allowed: {', '.join(known)}")
    return tuple(known[name] for name in dict.fromkeys(names))


def _hosts(rig: Rig, members: tuple[Member, ...], options: list[str] | tuple[str, ...]) -> dict[Member, tuple[str, ...]]:
    """Hosts of each member: names of this machine, endpoints of the rig, and options.  Raises UserError."""
    from zenocap.common.bus.access import ROUTER
    from zenocap.common.errors import UserError
    from zenocap.common.rig.security import host_of

    called = ROUTER if rig.zenoh.mode == "client" else "integrator"
    hosts = {member.name: ["localhost", "127.0.0.1", "::1"] for member in members}
    for endpoint in rig.zenoh.connect:
        hosts.get(called, []).append(host_of(endpoint))
    for option in options:
        name, equals, host = option.partition("=")
        if not equals or not host or name not in hosts:
            raise UserError(f"--host {option}: allowed: NAME=HOST, NAME one of {', '.join(hosts)}")
        hosts[name].append(host)
    return {member: tuple(dict.fromkeys(hosts[member.name])) for member in members}
