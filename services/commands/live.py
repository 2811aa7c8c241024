"""Commands that run on the network: demo, up, viewer, integrator, tracker, router."""

from pathlib import Path
from typing import Annotated

import typer

from services.commands.options import (
    DONE,
    ConfigOption,
    ConnectOption,
    ListenOption,
    ModeOption,
    NoMulticastOption,
    RigPath,
    one_line_errors,
    rig_at,
    security,
    take_folder,
    zenoh_options,
)

SecondsOption = Annotated[
    float | None, typer.Option("--seconds", min=0.1, help="End after so long; default: with Ctrl-C.", show_default=False)
]
FolderOption = Annotated[
    Path | None,
    typer.Option("--recordings", metavar="DIR", help="Where the take is written.", show_default=False),
]
NoLogOption = Annotated[bool, typer.Option("--no-log", help="Write no take.")]
NoPageOption = Annotated[bool, typer.Option("--no-page", help="Without the animator and its page.")]
WithParentOption = Annotated[bool, typer.Option("--with-parent", hidden=True)]


def demo(
    seconds: SecondsOption = None,
    recordings: FolderOption = None,
    no_log: NoLogOption = False,
    no_page: NoPageOption = False,
) -> None:
    """Everything on this machine with a synthetic actor: no camera, no network needed.

    Two viewers film an actor from the front and from the side, the integrator joins what they find, and everything that
    was said is written to recordings/demo-TIME.mcap. A table shows what each of them does, and the page at
    http://127.0.0.1:8080 shows the actor.

    Example: `zenocap demo --seconds 30`
    """
    from common.runtime.rig import demo_rig_file

    with one_line_errors():
        rig_file = demo_rig_file()
        _run(rig_file, seconds, recordings or Path("recordings"), no_log, no_page, None, None, None, None, True)


def up(
    rig: RigPath,
    seconds: SecondsOption = None,
    recordings: FolderOption = None,
    no_log: NoLogOption = False,
    no_page: NoPageOption = False,
    mode: ModeOption = None,
    connect: ConnectOption = None,
    listen: ListenOption = None,
    config: ConfigOption = None,
    no_multicast_scouting: NoMulticastOption = False,
) -> None:
    """Every service of a rig on this machine, watched: one that dies is started again.

    The services are processes that meet over loopback. With --listen the integrator can be called from other machines.
    Videos are played once, at their own speed; cameras run until Ctrl-C. `zenocap track` is for every frame of a video.

    Example: `zenocap up studio.toml`
    """
    with one_line_errors():
        _run(rig, seconds, recordings, no_log, no_page, mode, connect, listen, config, no_multicast_scouting)


def _run(
    path: Path,
    seconds: float | None,
    recordings: Path | None,
    no_log: bool,
    no_page: bool,
    mode: ModeOption,
    connect: list[str] | None,
    listen: list[str] | None,
    config: Path | None,
    no_multicast_scouting: bool,
) -> None:
    import time

    from rich.console import Console

    from common.runtime.signals import stop_signals
    from common.take.naming import take_path
    from services.launcher.shell import run_rig

    rig = rig_at(path, files=True)
    options = zenoh_options(rig, mode, connect, listen, config, no_multicast_scouting)
    wanted = rig.log.enabled and not no_log
    take = take_path(rig.name, take_folder(rig, path, recordings), time.time_ns()) if wanted else None
    with stop_signals() as stopped:
        raise typer.Exit(run_rig(rig, path, options, take, seconds, stopped, Console(), page=not no_page))


def viewer(
    rig: RigPath,
    id: Annotated[str, typer.Option("--id", help="Which viewer of the rig this is.", show_default=False)],
    mode: ModeOption = None,
    connect: ConnectOption = None,
    listen: ListenOption = None,
    config: ConfigOption = None,
    no_multicast_scouting: NoMulticastOption = False,
    epoch_ns: Annotated[int | None, typer.Option("--epoch-ns", hidden=True)] = None,
    with_parent: WithParentOption = False,
) -> None:
    """One viewer of a rig: turns a camera's images into silhouettes, sightings and joint angles.

    Start it on the camera's machine, before or after the others; images stay there. It ends with Ctrl-C, or with its
    video. Viewers of videos agree on when to begin.

    Example, on two machines: `zenocap viewer studio.toml --id 1`, `zenocap viewer studio.toml --id 2`
    """
    from common.runtime import logs
    from common.runtime.signals import stop_signals
    from services.viewer.shell import run_viewer

    logs.configure(f"viewer {id}")
    with one_line_errors(), stop_signals(with_parent=with_parent) as stopped:
        one = rig_at(rig, files=False)
        options = zenoh_options(one, mode, connect, listen, config, no_multicast_scouting, f"viewer-{id}")
        raise typer.Exit(run_viewer(one, id, options, stopped, epoch_ns))


def integrator(
    rig: RigPath,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", help="The take; default: a new name by rig and time."),
    ] = None,
    no_log: NoLogOption = False,
    mode: ModeOption = None,
    connect: ConnectOption = None,
    listen: ListenOption = None,
    config: ConfigOption = None,
    no_multicast_scouting: NoMulticastOption = False,
    with_parent: WithParentOption = False,
) -> None:
    """The integrator of a rig: pairs what the viewers see, answers who sees the facade, and gives the pose.

    It also writes the take: every message of the rig. It runs until Ctrl-C, and exits with 3 when messages
    were lost, or the log could not be written.

    Example: `zenocap integrator studio.toml -o monday.mcap`
    """
    import time

    from common.runtime import logs
    from common.runtime.signals import stop_signals
    from common.take.naming import free_name, take_path
    from services.integrator.shell import run_integrator

    logs.configure("integrator")
    with one_line_errors(), stop_signals(with_parent=with_parent) as stopped:
        one = rig_at(rig, files=False)
        options = zenoh_options(one, mode, connect, listen, config, no_multicast_scouting, "integrator")
        take = None
        if output is not None:
            take = free_name(output) if with_parent else output
        elif one.log.enabled and not no_log:
            take = take_path(one.name, take_folder(one, rig, None), time.time_ns())
        # A file that somebody asked for must be written; a default, or the launcher's, must not keep the rig from tracking.
        must_log = output is not None and not with_parent
        raise typer.Exit(run_integrator(one, options, take, stopped, must_log=must_log))


def tracker(
    rig: RigPath,
    mode: ModeOption = None,
    connect: ConnectOption = None,
    listen: ListenOption = None,
    config: ConfigOption = None,
    no_multicast_scouting: NoMulticastOption = False,
    with_parent: WithParentOption = False,
) -> None:
    """The tracker of a rig whose method is hybrid: from the viewers' silhouettes to the pose, with its spread.

    It takes the silhouettes of any two or more of the rig's viewers, which may come and go while it runs. The body is
    measured when the person shows the initial posture, arms stretched sideways. It runs until Ctrl-C.

    Example: `zenocap tracker studio.toml`
    """
    from common.runtime import logs
    from common.runtime.rig_file import TRACKER_METHODS, RigError
    from common.runtime.signals import stop_signals
    from services.tracker.shell import run_tracker

    logs.configure("tracker")
    with one_line_errors(), stop_signals(with_parent=with_parent) as stopped:
        one = rig_at(rig, files=False)
        if one.tracker is None:
            raise RigError(f"{rig}: method = {one.method!r}: allowed for a tracker: {', '.join(TRACKER_METHODS)}")
        options = zenoh_options(one, mode, connect, listen, config, no_multicast_scouting, "tracker")
        raise typer.Exit(run_tracker(one, options, stopped))


def router(
    rigs: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[RIG...]", help="Rigs with a [security] table: only their members are let in."),
    ] = None,
    connect: ConnectOption = None,
    listen: ListenOption = None,
    config: ConfigOption = None,
    no_multicast_scouting: NoMulticastOption = False,
) -> None:
    """A Zenoh router, for networks where the services cannot find each other.

    For rigs with a [security] table it lets in only who has a certificate (see `zenocap certs`), and each says only what is
    its own to say. Without a rig it is open to all who can reach it.

    Example: `zenocap router -l tcp/0.0.0.0:7447`, and on the other machines `-m client -e tcp/HOST:7447`;
    `zenocap router studio.toml lab.toml` for secured rigs.
    """
    from dataclasses import replace

    from common.bus.zenoh_session import router as run_router
    from common.runtime import logs
    from common.runtime.signals import stop_signals

    logs.configure("router")
    with one_line_errors(), stop_signals() as stopped:
        secured = security([rig_at(rig, files=False) for rig in rigs or ()], "router")
        options = zenoh_options(None, "router", connect, listen, config, no_multicast_scouting)
        run_router(replace(options, security=secured), stopped)
        raise typer.Exit(DONE)
