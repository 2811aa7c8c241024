"""The command that shows the virtual actor: animator."""

from pathlib import Path
from typing import Annotated

import typer

from services.commands.options import (
    ConfigOption,
    ConnectOption,
    ListenOption,
    ModeOption,
    NoMulticastOption,
    RigPath,
    one_line_errors,
    rig_at,
    take_folder,
    zenoh_options,
)


def animator(
    rig: RigPath,
    host: Annotated[
        str | None,
        typer.Option("--host", help="Address of this machine that the page is on; default: the rig's, or 127.0.0.1."),
    ] = None,
    port: Annotated[
        int | None, typer.Option("--port", min=0, max=65535, help="0 for any free one; default: the rig's, or 8080.")
    ] = None,
    token: Annotated[
        str | None, typer.Option("--token", help="What who opens the page must know; needed with an open --host.")
    ] = None,
    recordings: Annotated[
        Path | None,
        typer.Option("--recordings", metavar="DIR", help="Where the takes to be played are; default: the rig's."),
    ] = None,
    mode: ModeOption = None,
    connect: ConnectOption = None,
    listen: ListenOption = None,
    config: ConfigOption = None,
    no_multicast_scouting: NoMulticastOption = False,
    with_parent: Annotated[bool, typer.Option("--with-parent", hidden=True)] = False,
) -> None:
    """The virtual actor of a rig, live on a page at http://127.0.0.1:8080, and out to the rig's outputs.

    Open the page in any browser. It shows the actor, the cameras and what they see, how well every service does, and what
    to put right while setting up. It loads nothing from elsewhere. Other machines may look only at an open --host with a
    --token.

    Example: `zenocap animator studio.toml`
    """
    from dataclasses import replace

    import msgspec

    from common.runtime import logs
    from common.runtime.animator_table import PageTable, open_page_problem
    from common.runtime.rig_file import RigError
    from common.runtime.signals import stop_signals
    from services.animator.shell import run_animator

    logs.configure("animator")
    with one_line_errors(), stop_signals(with_parent=with_parent) as stopped:
        one = rig_at(rig, files=False)
        wished = {name: value for name, value in (("host", host), ("port", port), ("token", token)) if value is not None}
        try:
            page = msgspec.convert(msgspec.to_builtins(one.animator.page) | wished, PageTable)
        except msgspec.ValidationError as error:
            raise RigError(f"page: {error}") from error
        problem = open_page_problem(page)
        if problem:
            raise RigError(f"animator.page.host = {page.host!r}: {problem}")
        one = replace(one, animator=msgspec.structs.replace(one.animator, page=page))
        options = zenoh_options(one, mode, connect, listen, config, no_multicast_scouting)
        raise typer.Exit(run_animator(one, take_folder(one, rig, recordings), options, stopped))
