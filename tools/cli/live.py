"""Commands that run services: demo, up, viewer, integrator, tracker, router; and warmup, which compiles for them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.tools.cli.options import DONE, FAILED, RigPath, one_line_errors, rig_at, take_folder
from zenocap.tools.cli.zenoh_arguments import RouterArguments, ZenohArguments, security

if TYPE_CHECKING:  # imported where it is used: `zenocap --help` answers at once
    from zenocap.common.rig.rig import Rig

SecondsOption = Annotated[
    float | None, typer.Option("--seconds", min=0.1, help="Running time (s); default: until Ctrl-C.", show_default=False)
]
FolderOption = Annotated[
    Path | None,
    typer.Option("--recordings", metavar="DIR", help="Folder of the take; default: the rig's.", show_default=False),
]
NoLogOption = Annotated[bool, typer.Option("--no-log", help="Record no take.")]
NoPageOption = Annotated[bool, typer.Option("--no-page", help="Run without the animator and its page.")]
PortOption = Annotated[
    int | None,
    typer.Option("--port", min=0, max=65535, help="TCP port of the page, 0 for any free one; default: the rig's, or 8080."),
]
WithParentOption = Annotated[bool, typer.Option("--with-parent", hidden=True)]


def demo(
    seconds: SecondsOption = None,
    recordings: Annotated[
        Path | None, typer.Option("--recordings", metavar="DIR", help="Folder of the take; default: recordings.")
    ] = None,
    no_log: NoLogOption = False,
    no_page: NoPageOption = False,
    port: PortOption = None,
    method: Annotated[
        Literal["auto", "two-view"],
        typer.Option(help="Tracking method: auto is the tracker, two-view the paper's two-view method in 160x120 images."),
    ] = "auto",
) -> None:
    """Run everything on this machine with a simulated person: no camera and no network needed.

    Two viewers render the person from the front and from the side, the tracker estimates the pose from their silhouettes,
    and every message is recorded to recordings/demo-TIME.mcap. With --method two-view the viewers estimate the pose and the
    integrator fuses their results. A table shows the state of each service, and the page at http://127.0.0.1:8080 the pose.

    Example: `zenocap demo --seconds 30`
    """
    from zenocap.common.rig.rig import demo_rig_file

    with one_line_errors():
        loopback = ZenohArguments(no_multicast_scouting=True)
        folder = recordings or Path("recordings")
        _run(demo_rig_file(method), seconds, folder, loopback, log=not no_log, page=not no_page, port=port)


def up(
    rig: RigPath,
    seconds: SecondsOption = None,
    recordings: FolderOption = None,
    no_log: NoLogOption = False,
    no_page: NoPageOption = False,
    port: PortOption = None,
    *,
    zenoh: ZenohArguments,
) -> None:
    """Run every service of a rig on this machine, restart those that fail, and record a take.

    The services are processes that communicate over loopback; with --listen the integrator accepts connections from other
    machines. Cameras run until Ctrl-C, videos are played once at their own frame rate (FPS). To track every frame of
    videos, use `zenocap track`.

    Example: `zenocap up studio.toml`
    """
    with one_line_errors():
        _run(rig, seconds, recordings, zenoh, log=not no_log, page=not no_page, port=port)


def _run(
    path: Path,
    seconds: float | None,
    recordings: Path | None,
    zenoh: ZenohArguments,
    *,
    log: bool,
    page: bool,
    port: int | None,
) -> None:
    import time

    from rich.console import Console

    from zenocap.common.recording.parts import take_path
    from zenocap.common.runtime.signals import stop_signals
    from zenocap.tools.cli.certs import renew_certificates
    from zenocap.tools.launcher.shell import run_rig

    rig = rig_at(path, files=True)
    renew_certificates(rig)
    options = zenoh.options(rig)
    take = take_path(rig.name, take_folder(rig, path, recordings), time.time_ns()) if rig.log.enabled and log else None
    with stop_signals() as stopped:
        raise typer.Exit(run_rig(rig, path, options, take, seconds, stopped, Console(), page=page, port=port))


def viewer(
    rig: Annotated[
        Path | None,
        typer.Argument(
            metavar="[RIG]",
            help="Rig file (TOML), or folder with calibration.toml and videos/; none with --discover.",
            show_default=False,
        ),
    ] = None,
    id: Annotated[str | None, typer.Option("--id", help="Id of the viewer in the rig file.", show_default=False)] = None,
    discover: Annotated[
        bool,
        typer.Option(
            "--discover", help="Announce the cameras of this machine; let `zenocap film` record and `zenocap up` use them."
        ),
    ] = False,
    camera: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=SOURCE",
            help="With --discover, or for a rig's discover:MACHINE/NAME: a further camera or stream; may be repeated.",
        ),
    ] = None,
    machine: Annotated[
        str | None, typer.Option(metavar="NAME", help="With --discover: name of this machine; default: its host name.")
    ] = None,
    films: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER", help="Folder of the films of `zenocap film`; default: films beside the rig file, or here."
        ),
    ] = None,
    allow_fetch: Annotated[
        bool,
        typer.Option("--allow-fetch", help="Let `zenocap film --fetch` copy films from here without certificates."),
    ] = False,
    epoch_ns: Annotated[int | None, typer.Option("--epoch-ns", hidden=True)] = None,
    assigned: Annotated[Path | None, typer.Option(hidden=True, help="Saved assignment of a --discover process.")] = None,
    with_parent: WithParentOption = False,
    *,
    zenoh: ZenohArguments,
) -> None:
    """Run one viewer of a rig: from the images of a camera to silhouettes, sightings and joint angles.

    Run it on the camera's machine, before or after the other services; images stay there. It ends with Ctrl-C, or with its
    video. Viewers of videos agree on a common start.

    With --discover it needs no rig file: it announces the cameras of this machine (`zenocap cameras --discover` lists
    them), records those that `zenocap film` asks for into its folder of films, and runs the viewers of a rig whose file
    has `source = "discover:MACHINE/CAMERA"`, while `zenocap up` runs there. Everybody on the network can then do this.

    Example, on two machines: `zenocap viewer studio.toml --id 1`, `zenocap viewer studio.toml --id 2`
    """
    from zenocap.common.runtime import logs
    from zenocap.common.runtime.signals import stop_signals

    if discover and (rig is not None or id is not None):
        raise typer.BadParameter("--discover: allowed without RIG and --id")
    if not discover and assigned is None and (rig is None or id is None):
        raise typer.BadParameter("RIG and --id are missing: allowed: both, or --discover")
    if not discover and machine:
        raise typer.BadParameter("--machine: allowed with --discover")
    logs.configure("cameras" if discover else f"viewer {id}" if id else "viewer")
    with one_line_errors(), stop_signals(with_parent=with_parent) as stopped:
        if discover:
            from zenocap.services.viewer.film.host import run_host
            from zenocap.services.viewer.film.parameters import FILMS

            folder = films or Path(FILMS)
            command = partial(_assigned_command, zenoh, folder, allow_fetch)
            options = zenoh.options()
            raise typer.Exit(
                run_host(machine, camera or (), folder, options, stopped, allow_fetch=allow_fetch, command=command)
            )  # fmt: skip
        from zenocap.services.viewer.shell import run_viewer

        if assigned is not None:
            from zenocap.services.viewer.hosted.saved import saved_rig

            one, id = saved_rig(assigned, films or Path())
            raise typer.Exit(run_viewer(one, id, zenoh.options(), stopped, None, films, allow_fetch=allow_fetch))
        assert rig is not None
        assert id is not None
        one = _with_own_camera(rig_at(rig, files=False), id, camera or ())
        options = zenoh.options(one, f"viewer-{id}")
        raise typer.Exit(run_viewer(one, id, options, stopped, epoch_ns, films, allow_fetch=allow_fetch))


def _with_own_camera(rig: Rig, id: str, named: Sequence[str]) -> Rig:
    """The rig, with the camera of this machine where viewer `id` has an announced one.  named: NAME=SOURCE of cameras.

    Raises UserError.
    """
    from dataclasses import replace

    from zenocap.common.errors import UserError
    from zenocap.common.rig.sources import Announced
    from zenocap.services.viewer.film.host_cameras import own_camera

    own = rig.viewer(id)
    if not isinstance(own.source, Announced):
        if named:
            raise UserError('--camera: allowed with --discover, or for a viewer with source = "discover:MACHINE/CAMERA"')
        return rig
    viewer = replace(own, source=own_camera(own.source, named))
    return replace(rig, viewers=tuple(viewer if one is own else one for one in rig.viewers))


def _assigned_command(zenoh: ZenohArguments, films: Path, allow_fetch: bool, file: Path) -> list[str]:
    """Command of the viewer of a saved assignment: it connects where this process does, and to this process."""
    import sys

    near = [one.replace("/0.0.0.0:", "/127.0.0.1:").replace("/[::]:", "/[::1]:") for one in zenoh.listen or ()]
    words = [sys.executable, "-P", "-m", "zenocap", "viewer", "--assigned", str(file), "--films", str(films)]
    words += ["--with-parent", *["--allow-fetch"] * allow_fetch]
    mode = "client" if zenoh.mode == "router" else zenoh.mode
    words += ["--mode", mode] if mode else []
    for endpoint in (*(zenoh.connect or ()), *near):
        words += ["--connect", endpoint]
    words += ["--config", str(zenoh.config)] if zenoh.config else []
    return [*words, *["--no-multicast-scouting"] * zenoh.no_multicast_scouting]


def integrator(
    rig: RigPath,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", help="Take to write; default: a new name of rig and time."),
    ] = None,
    no_log: NoLogOption = False,
    with_parent: WithParentOption = False,
    *,
    zenoh: ZenohArguments,
) -> None:
    """Run the integrator of a rig: pair the viewers' sightings, assign their roles, fuse their angles to the pose.

    It also records the take, with every message of the rig. It runs until Ctrl-C. Exit status 3: messages were lost, or the
    take could not be written.

    Example: `zenocap integrator studio.toml -o monday.mcap`
    """
    import time

    from zenocap.common.recording.parts import free_name, take_path
    from zenocap.common.runtime import logs
    from zenocap.common.runtime.signals import stop_signals
    from zenocap.services.integrator.shell import run_integrator
    from zenocap.tools.parameters import service_parameters

    logs.configure("integrator")
    with one_line_errors(), stop_signals(with_parent=with_parent) as stopped:
        one = rig_at(rig, files=False)
        options = zenoh.options(one, "integrator")
        take = None
        if output is not None:
            take = free_name(output) if with_parent else output
        elif one.log.enabled and not no_log:
            take = take_path(one.name, take_folder(one, rig, None), time.time_ns())
        # A take that was requested must be written; a default one, or the launcher's, must not stop the tracking.
        must_log = output is not None and not with_parent
        raise typer.Exit(run_integrator(one, options, take, stopped, service_parameters(one), must_log=must_log))


def tracker(
    rig: RigPath,
    with_parent: WithParentOption = False,
    *,
    zenoh: ZenohArguments,
) -> None:
    """Run the tracker of a rig with method hybrid: from the viewers' silhouettes to the pose and its uncertainty.

    It uses the silhouettes of two or more of the rig's viewers, which may come and go. The body is measured while the
    person stands in the T-pose (arms stretched sideways). It runs until Ctrl-C.

    Example: `zenocap tracker studio.toml`
    """
    from zenocap.common.errors import UserError
    from zenocap.common.rig.file import TRACKER_METHODS
    from zenocap.common.runtime import logs
    from zenocap.common.runtime.signals import stop_signals
    from zenocap.services.tracker.shell import run_tracker

    logs.configure("tracker")
    with one_line_errors(), stop_signals(with_parent=with_parent) as stopped:
        one = rig_at(rig, files=False)
        if one.tracker is None:
            raise UserError(f"{rig}: method = {one.method!r}: allowed for a tracker: {', '.join(TRACKER_METHODS)}")
        options = zenoh.options(one, "tracker")
        raise typer.Exit(run_tracker(one, options, stopped))


def router(
    rigs: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[RIG...]", help="Rigs with a [security] table: only their members are admitted."),
    ] = None,
    *,
    zenoh: RouterArguments,
) -> None:
    """Run a Zenoh router, for networks where the services cannot discover each other.

    For rigs with a [security] table it admits holders of a certificate only (see `zenocap certs`); each may publish only
    the topics of its own service. Without a rig it is open to everyone who can reach it.

    Example: `zenocap router -l tcp/0.0.0.0:7447`, and on the other machines `-m client -e tcp/HOST:7447`;
    `zenocap router studio.toml lab.toml` for secured rigs.
    """
    from zenocap.common.bus.zenoh_router import router as run_router
    from zenocap.common.rig.security import router_files
    from zenocap.common.runtime import logs
    from zenocap.common.runtime.signals import stop_signals

    logs.configure("router")
    with one_line_errors(), stop_signals() as stopped:
        secured_rigs = [rig_at(rig, files=False) for rig in rigs or ()]
        run_router(
            lambda revocations: zenoh.options(security(secured_rigs, "router", revocations.generations)),
            stopped,
            router_files(secured_rigs),
        )
        raise typer.Exit(DONE)


def warmup(part: Annotated[list[str] | None, typer.Option(hidden=True)] = None) -> None:
    """Compile everything that is otherwise compiled on first use, so that services start quickly.

    demo and up do it when needed; run it before a take where a late start matters. Once per installation.

    Example: `zenocap warmup`
    """
    if part:
        from zenocap.tools.warmup.parts import warm_up

        for one in part:
            warm_up(one)
        return
    from rich.console import Console

    from zenocap.common.runtime.signals import stop_signals
    from zenocap.tools.warmup.parts import PARTS
    from zenocap.tools.warmup.processes import compile_parts

    with stop_signals() as stopped:
        raise typer.Exit(DONE if compile_parts(tuple(PARTS), stopped, Console(stderr=True)) else FAILED)
