"""The command that runs one viewer, or the cameras of a machine: viewer."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.tools.cli.options import WithParentOption, one_line_errors, rig_at
from zenocap.tools.cli.zenoh_arguments import ZenohArguments

if TYPE_CHECKING:  # imported where it is used: `zenocap --help` answers at once
    from zenocap.common.rig.rig import Rig


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
    from zenocap.tools.cli.calibrate.board_options import detect_command

    if discover and (rig is not None or id is not None):
        raise typer.BadParameter("--discover: allowed without RIG and --id")
    if not discover and assigned is None and (rig is None or id is None):
        raise typer.BadParameter("RIG and --id are missing: allowed: both, or --discover")
    if not discover and machine:
        raise typer.BadParameter("--machine: allowed with --discover")
    logs.configure("cameras" if discover else f"viewer {id}" if id else "viewer")
    with one_line_errors(), stop_signals(with_parent=with_parent) as stopped:
        if discover:
            from zenocap.services.camera.parameters import FILMS
            from zenocap.services.camera.shell import run_host
            from zenocap.services.viewer.sources.source import images_of

            folder = films or Path(FILMS)
            command = partial(_assigned_command, zenoh, folder, allow_fetch)
            options = zenoh.options()
            raise typer.Exit(
                run_host(
                    machine, camera or (), folder, options, stopped, images_of, allow_fetch=allow_fetch, command=command,
                    detect=detect_command,
                )
            )  # fmt: skip
        from zenocap.services.camera.endpoint import filming_of
        from zenocap.services.viewer.shell import run_viewer

        if assigned is not None:
            from zenocap.services.camera.saved import saved_rig

            one, id = saved_rig(assigned, films or Path())
            options, epoch_ns = zenoh.options(), None
        else:
            assert rig is not None
            assert id is not None
            one = _with_own_camera(rig_at(rig, files=False), id, camera or ())
            options = zenoh.options(one, f"viewer-{id}")
        may_read = allow_fetch or options.security is not None
        filming = filming_of(one, id, films, may_read=may_read, detect=detect_command)
        raise typer.Exit(run_viewer(one, id, options, stopped, epoch_ns, filming))


def _with_own_camera(rig: Rig, id: str, named: Sequence[str]) -> Rig:
    """The rig, with the camera of this machine where viewer `id` has an announced one.  named: NAME=SOURCE of cameras.

    Raises UserError.
    """
    from dataclasses import replace

    from zenocap.common.errors import UserError
    from zenocap.common.rig.sources import Announced
    from zenocap.services.camera.host_cameras import own_camera

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
