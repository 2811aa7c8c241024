"""The command that makes certificates: certs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from zenocap.common.errors import UserError
from zenocap.tools.cli.options import LOSS, RigPath, one_line_errors, rig_at
from zenocap.tools.option_groups import option

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.bus.access import Member
    from zenocap.common.rig.rig import Rig


@dataclass(frozen=True)
class CertsArguments:
    """output: folder of the certificates."""

    output: Path | None = option(
        None, "The folder; default: the rig's own, else certs beside it.", "-o", "--output", metavar="DIR"
    )
    host: list[str] | None = option(
        None, "Host name or address of the member NAME, such as router=192.168.1.10; may be repeated.", metavar="NAME=HOST"
    )
    service: list[str] | None = option(
        None, "Only this member, such as viewer-1, operator or replay; may be repeated.", metavar="NAME"
    )
    days: int = option(730, "Validity (days).", min=1, max=3650)
    renew: bool = option(False, "Replace existing certificates and keys.")
    renew_within: int | None = option(None, "Replace those that expire within this time (days).", metavar="DAYS", min=1)
    revoke: list[str] | None = option(
        None, "Revoke all certificates of this member so far, and make it a new one; may be repeated.", metavar="NAME"
    )


def certs(rig: RigPath, *, given: CertsArguments) -> None:
    """Create the certificates of a rig, for its services and readers.

    It creates a certificate authority, and certificates for services, router, readers and recorders. Run it once on one
    machine and copy the listed files to each machine. Existing files are kept: run it again when a viewer is added. The
    hosts in the rig's `connect` belong to the router, or without a router to the integrator.

    Example: `zenocap certs studio.toml --host router=192.168.1.10`; `zenocap certs studio.toml --revoke viewer-1` after the
    machine of viewer 1 was lost: its routers exclude the certificate within seconds.
    """
    from datetime import UTC, datetime, timedelta

    from rich.console import Console

    from zenocap.common.rig.security import needed_members

    with one_line_errors():
        from zenocap.tools.setup.certificates.folder import certify
        from zenocap.tools.setup.certificates.report import report

        one = rig_at(rig, files=False)
        folder = given.output or one.security or one.base / "certs"
        if given.revoke:
            _revoke(one, folder, given.revoke, given.days)
            return
        members = _chosen(one, given.service, "--service") if given.service else needed_members(one)
        hosts_of_members = _hosts(one, members, given.host or ())
        within = None if given.renew_within is None else timedelta(days=given.renew_within)
        now = datetime.now(UTC)
        made = certify(folder, one.name, hosts_of_members, now, given.days, renew=given.renew, renew_within=within)
        if not made:
            raise UserError("no member to create a certificate for")
    Console().print(report(one.name, rig, folder, made, secured=one.security is not None), soft_wrap=True)


def renew_certificates(rig: Rig) -> None:
    """Renew the certificates of a secured rig that expire soon, where the key of its authority is on this machine."""
    from datetime import UTC, datetime
    from importlib.util import find_spec

    if rig.security is None or find_spec("cryptography") is None:
        return
    from zenocap.common.bus.access import ROUTER, Member
    from zenocap.common.rig.security import allowed_members
    from zenocap.tools.setup.certificates.folder import renew_expiring

    try:
        made = renew_expiring(rig.security, rig.name, (*allowed_members(rig), Member(ROUTER)), datetime.now(UTC))
    except (UserError, OSError) as error:
        typer.echo(f"certificates cannot be renewed: {error}", err=True)
        return
    if made:
        typer.echo(f"certificates renewed before they expire: {', '.join(one.member.name for one in made)}", err=True)


def _revoke(rig: Rig, folder: Path, names: list[str], days: int) -> None:
    """Revoke certificates, make new ones, and pass the list on to the rig's routers.  Raises UserError."""
    from datetime import UTC, datetime

    from zenocap.common.bus.access import READER
    from zenocap.common.bus.zenoh_revocations import confirmed, sender
    from zenocap.common.bus.zenoh_session import ZenohOptions
    from zenocap.common.rig.security import certificate_file, revocations_file, security_in
    from zenocap.tools.setup.certificates.folder import renewed, revoke

    now = datetime.now(UTC)
    members = _chosen(rig, names, "--revoke")
    options = None
    if rig.zenoh.connect and certificate_file(folder, READER).exists():
        options = ZenohOptions("client", rig.zenoh.connect, multicast_scouting=False, security=security_in(folder, READER))
    with sender(options, rig.name) as send:  # by the present certificate of the reader, which may be among the revoked
        signed = revoke(folder, rig.name, members, now)
        typer.echo(f"revoked: {', '.join(member.name for member in members)} (list {signed.number})")
        made = renewed(folder, rig.name, members, now, days)
        if made:
            typer.echo(f"new certificates, for their machines: {', '.join(one.member.name for one in made)}")
        sent = send(signed.encoded())
    routers = confirmed(options, rig.name, signed.number) if sent and options is not None else 0
    if routers:
        typer.echo(f"excluded by {routers} router{'s' * (routers != 1)} of the rig")
        return
    typer.echo(
        f"no router of the rig was reached: copy {revocations_file(folder)} beside the certificates of every router, and "
        "of every service of a rig without a router",
        err=True,
    )
    raise typer.Exit(LOSS)


def _chosen(rig: Rig, names: list[str] | tuple[str, ...], option: str) -> tuple[Member, ...]:
    """The members of these names.  Raises UserError."""
    from zenocap.common.bus.access import ROUTER, Member
    from zenocap.common.rig.security import allowed_members

    known = {member.name: member for member in (*allowed_members(rig), Member(ROUTER))}
    for name in names:
        if name not in known:
            raise UserError(f"{option} {name}: allowed: {', '.join(known)}")
    return tuple(known[name] for name in dict.fromkeys(names))


def _hosts(rig: Rig, members: tuple[Member, ...], options: list[str] | tuple[str, ...]) -> dict[Member, tuple[str, ...]]:
    """Hosts of each member: names of this machine, endpoints of the rig, and options.  Raises UserError."""
    from zenocap.common.bus.access import ROUTER
    from zenocap.common.rig.security import host_of

    called = ROUTER if rig.zenoh.mode == "client" else "integrator"
    hosts = {member.name: ["localhost", "127.0.0.1", "::1"] for member in members}
    for endpoint in rig.zenoh.connect:
        hosts.get(called, []).append(host_of(endpoint))
    for one in options:
        name, equals, host = one.partition("=")
        if not equals or not host or name not in hosts:
            raise UserError(f"--host {one}: allowed: NAME=HOST, NAME one of {', '.join(hosts)}")
        hosts[name].append(host)
    return {member: tuple(dict.fromkeys(hosts[member.name])) for member in members}
