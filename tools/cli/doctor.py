"""The command `doctor`."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.common.errors import UserError
from zenocap.tools.cli.options import DONE, FAILED, JsonOption, RigPath, one_line_errors, rig_at, take_folder
from zenocap.tools.service_arguments import ZenohArguments

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.rig.rig import Rig
    from zenocap.tools.setup.doctor.finding import CheckResult

MAX_WORDS = 2000  # characters of a finding
STYLES = {"ok": "green", "warning": "yellow", "wrong": "red"}


def doctor(
    rig: RigPath,
    service: Annotated[
        str | None,
        typer.Option(
            "--service", metavar="NAME", help="Service of this machine, such as viewer-1 or integrator; default: all."
        ),
    ] = None,
    as_json: JsonOption = False,
    *,
    zenoh: ZenohArguments,
) -> None:
    """Find what is wrong with a rig, and how to mend it.

    On this machine and its network, before the rig runs or while it does. Checks the rig file, the connection to router and
    services, differing rig files and versions, clocks, rejected messages, cameras, their images as running viewers measure
    them, videos and their size, calibration, disk, ports, certificates, and kernels that are not compiled yet. Changes
    nothing. Exit status 1 when a fault was found; warnings do not count.

    Example: `zenocap doctor studio.toml --service viewer-1`
    """
    from zenocap.tools.setup.doctor.finding import ok, wrong

    try:
        one = rig_at(rig, files=False)
    except UserError as error:
        findings = [wrong("rig file", str(error), "correct the file; it must be the same on every machine")]
    else:
        with one_line_errors():
            from zenocap.tools.setup.doctor.shell import examine

            name = _member(one, service)
            options = zenoh.options(one, name)
            findings = [ok("rig file", f"{rig}: rig {one.name}, method {one.method}")]
            findings += examine(one, rig, options, take_folder(one, rig, None), service)
    _print(findings, as_json)
    raise typer.Exit(FAILED if any(finding.verdict == "wrong" for finding in findings) else DONE)


def _member(rig: Rig, service: str | None) -> str:
    """By whose certificate to look: a reader's, or that of the service.  Raises UserError for a service it has not."""
    from zenocap.common.rig.security import allowed_members, certificate_file
    from zenocap.tools.setup.doctor.machine_probe import certified

    known = [member.name for member in allowed_members(rig)]
    if service is not None and service not in known:
        raise UserError(f"--service {service}: allowed: {', '.join(known)}")
    if rig.security is None or certificate_file(rig.security, "reader").is_file():
        return "reader"
    return service or next(iter(certified(rig.security)), "reader")


def _print(findings: list[CheckResult], as_json: bool) -> None:
    if as_json:
        typer.echo(json.dumps({"findings": [asdict(finding) for finding in findings]}))
        return
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from zenocap.common.runtime.foreign_text import printable

    table = Table(box=None, show_header=False, pad_edge=False)
    for _ in range(3):
        table.add_column(overflow="fold")
    for finding in findings:
        cell = Text(printable(finding.words, MAX_WORDS))
        if finding.remedy:
            cell.append(f"\n{printable(finding.remedy, MAX_WORDS)}", style="italic")
        table.add_row(Text(finding.verdict, style=STYLES[finding.verdict]), Text(printable(finding.check)), cell)
    console = Console()
    console.print(table)
    counts = {verdict: sum(finding.verdict == verdict for finding in findings) for verdict in STYLES}
    console.print(Text(", ".join(f"{count} {verdict}" for verdict, count in counts.items())))
