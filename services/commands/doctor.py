"""The command that says what is wrong: doctor."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from services.commands.options import (
    DONE,
    FAILED,
    ConfigOption,
    ConnectOption,
    JsonOption,
    ListenOption,
    ModeOption,
    NoMulticastOption,
    RigPath,
    one_line_errors,
    rig_at,
    take_folder,
    zenoh_options,
)

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from common.runtime.rig import Rig
    from services.doctor.finding import Finding

STYLES = {"ok": "green", "warning": "yellow", "wrong": "red"}


def doctor(
    rig: RigPath,
    service: Annotated[
        str | None,
        typer.Option(
            "--service", metavar="NAME", help="What this machine runs, such as viewer-1 or integrator; default: all."
        ),
    ] = None,
    as_json: JsonOption = False,
    mode: ModeOption = None,
    connect: ConnectOption = None,
    listen: ListenOption = None,
    config: ConfigOption = None,
    no_multicast_scouting: NoMulticastOption = False,
) -> None:
    """What is wrong with a rig, here and on its network, and what to do about each.

    It looks at the rig file, whether router and others can be reached, who runs with another rig file or version, clocks,
    refused messages, cameras and videos and their size, the disk, ports, certificates, and what is not compiled yet. It
    changes nothing and may run beside everything else. Exit status 1 when something is wrong; warnings do not count.

    Example: `zenocap doctor studio.toml --service viewer-1`
    """
    from common.runtime.rig import RigError
    from services.doctor.finding import ok, wrong

    try:
        one = rig_at(rig, files=False)
    except RigError as error:
        findings = [wrong("rig file", str(error), "correct the file; it must be the same on every machine")]
    else:
        with one_line_errors():
            from services.doctor.shell import examine

            name = _member(one, service)
            options = zenoh_options(one, mode, connect, listen, config, no_multicast_scouting, name)
            findings = [ok("rig file", f"{rig}: rig {one.name}, method {one.method}")]
            findings += examine(one, rig, options, take_folder(one, rig, None), service)
    _say(findings, as_json)
    raise typer.Exit(FAILED if any(finding.verdict == "wrong" for finding in findings) else DONE)


def _member(rig: Rig, service: str | None) -> str:
    """By whose certificate to look: a reader's, or that of the service.  Raises RigError for a service it has not."""
    from common.runtime.rig import RigError
    from common.runtime.security import allowed_members, certificate_file
    from services.doctor.machine_look import certified

    known = [member.name for member in allowed_members(rig)]
    if service is not None and service not in known:
        raise RigError(f"--service {service}: allowed: {', '.join(known)}")
    if rig.security is None or certificate_file(rig.security, "reader").is_file():
        return "reader"
    return service or next(iter(certified(rig.security)), "reader")


def _say(findings: list[Finding], as_json: bool) -> None:
    if as_json:
        typer.echo(json.dumps({"findings": [asdict(finding) for finding in findings]}))
        return
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, show_header=False, pad_edge=False)
    for _ in range(3):
        table.add_column(overflow="fold")
    for finding in findings:
        words = Text(finding.words)
        if finding.remedy:
            words.append(f"\n{finding.remedy}", style="italic")
        table.add_row(Text(finding.verdict, style=STYLES[finding.verdict]), finding.check, words)
    console = Console()
    console.print(table)
    counts = {verdict: sum(finding.verdict == verdict for finding in findings) for verdict in STYLES}
    console.print(Text(", ".join(f"{count} {verdict}" for verdict, count in counts.items())))
