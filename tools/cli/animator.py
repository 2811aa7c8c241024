"""The command that shows a live rig: animator."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from zenocap.tools.cli.options import RigPath, one_line_errors, rig_at, take_folder
from zenocap.tools.option_groups import option
from zenocap.tools.service_arguments import ServiceArguments

if TYPE_CHECKING:  # imported where it is used: `zenocap --help` answers at once
    from zenocap.common.rig.rig import Rig


@dataclass(frozen=True)
class AnimatorArguments:
    """Address of the page; recordings: folder of the takes that it can play."""

    host: str | None = option(None, "Address of the page on this machine; default: the rig's, or 127.0.0.1.")
    port: int | None = option(None, "Port of the page, 0 for any free one; default: the rig's, or 8080.", min=0, max=65535)
    token: str | None = option(
        None,
        "Access token of the page; required with a --host that other machines can reach. `new` generates and prints one.",
    )
    recordings: Path | None = option(None, "Folder of the takes that the page can play; default: the rig's.", metavar="DIR")


def animator(rig: RigPath, *, given: AnimatorArguments, arguments: ServiceArguments) -> None:
    """Show a live rig on a page, and send its poses to its outputs.

    Open http://127.0.0.1:8080 in any browser. The page shows the virtual actor, the views of the cameras, the state of
    every service, and during the set-up what to correct. It loads nothing from other servers. Other machines can open
    it only with --host and --token. For a recorded take, use `zenocap show`.

    Example: `zenocap animator studio.toml`
    """
    from zenocap.common.errors import UserError
    from zenocap.services.animator.shell import run_animator

    with one_line_errors(), arguments.running("animator") as stopped:
        if rig.suffix == ".mcap":
            raise UserError(f"{rig} is a take; zenocap show {rig} shows it")
        loaded = _with_page(rig_at(rig, files=False), given)
        options = arguments.options(loaded, "animator")
        raise typer.Exit(run_animator(loaded, take_folder(loaded, rig, given.recordings), options, stopped))


def _with_page(rig: Rig, given: AnimatorArguments) -> Rig:
    """The rig with its page at that address, as far as it is given.  Raises UserError."""
    from secrets import token_urlsafe

    import msgspec

    from zenocap.common.errors import UserError
    from zenocap.common.rig.animator import PageTable, open_page_problem

    token = token_urlsafe(24) if given.token == "new" else given.token
    values = {"host": given.host, "port": given.port, "token": token}
    values = {name: value for name, value in values.items() if value is not None}
    try:
        page = msgspec.convert(msgspec.to_builtins(rig.animator.page) | values, PageTable)
    except msgspec.ValidationError as error:
        raise UserError(f"page: {error}") from error
    if problem := open_page_problem(page):
        raise UserError(f"animator.page.host = {page.host!r}: {problem}")
    return replace(rig, animator=msgspec.structs.replace(rig.animator, page=page))
