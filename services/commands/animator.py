"""The command that shows the virtual actor: animator."""

from pathlib import Path
from typing import Annotated

import typer

from services.commands import rendering as to
from services.commands.options import (
    ConfigOption,
    ConnectOption,
    ListenOption,
    ModeOption,
    NoMulticastOption,
    one_line_errors,
    rig_at,
    take_folder,
    zenoh_options,
)


def animator(
    rig: Annotated[
        Path,
        typer.Argument(
            metavar="RIG|TAKE", help="A rig file or folder; with --render a take, an MCAP file.", show_default=False
        ),
    ],
    host: Annotated[
        str | None,
        typer.Option("--host", help="Address of this machine that the page is on; default: the rig's, or 127.0.0.1."),
    ] = None,
    port: Annotated[
        int | None, typer.Option("--port", min=0, max=65535, help="0 for any free one; default: the rig's, or 8080.")
    ] = None,
    token: Annotated[
        str | None,
        typer.Option(
            "--token",
            help="What who opens the page must know; needed with an open --host. `new`: a random one, which is said.",
        ),
    ] = None,
    recordings: Annotated[
        Path | None,
        typer.Option("--recordings", metavar="DIR", help="Where the takes to be played are; default: the rig's."),
    ] = None,
    render: to.RenderOption = None,
    first: to.FromOption = None,
    last: to.UntilOption = None,
    view: to.ViewOption = "quarter",
    follow: to.FollowOption = False,
    turn: to.TurnOption = 0.0,
    size: to.SizeOption = "1280x720",
    fps: to.FpsOption = None,
    look: to.LookOption = "light",
    poses: to.PosesOption = 1,
    trails: to.TrailsOption = 0.0,
    no_captions: to.NoCaptionsOption = False,
    codec: to.CodecOption = "vp9",
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

    With --render it needs no rig, network or screen: it draws the poses of a take into a file.

    Example: `zenocap animator studio.toml`, or `zenocap animator walk.mcap --render walk.mp4 --follow`
    """
    if render is not None:
        to.render_take(
            rig, render, first, last, view, follow, turn, size, fps, look, poses, trails, no_captions, codec
        )  # fmt: skip
    if rig.suffix == ".mcap":
        raise typer.BadParameter(f"{rig} is a take: allowed with --render, or play it: zenocap replay {rig}")
    from dataclasses import replace
    from secrets import token_urlsafe

    import msgspec

    from common.runtime import logs
    from common.runtime.animator_table import PageTable, open_page_problem
    from common.runtime.rig_file import RigError
    from common.runtime.signals import stop_signals
    from services.animator.shell import run_animator

    logs.configure("animator")
    with one_line_errors(), stop_signals(with_parent=with_parent) as stopped:
        one = rig_at(rig, files=False)
        token = token_urlsafe(24) if token == "new" else token
        wished = {name: value for name, value in (("host", host), ("port", port), ("token", token)) if value is not None}
        try:
            page = msgspec.convert(msgspec.to_builtins(one.animator.page) | wished, PageTable)
        except msgspec.ValidationError as error:
            raise RigError(f"page: {error}") from error
        problem = open_page_problem(page)
        if problem:
            raise RigError(f"animator.page.host = {page.host!r}: {problem}")
        one = replace(one, animator=msgspec.structs.replace(one.animator, page=page))
        options = zenoh_options(one, mode, connect, listen, config, no_multicast_scouting, "animator")
        raise typer.Exit(run_animator(one, take_folder(one, rig, recordings), options, stopped))
