"""The command that runs one viewer, or the cameras of a machine: viewer."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.common.errors import UserError
from zenocap.common.rig.services import MAIN
from zenocap.tools.cli.options import one_line_errors, refuse, rig_at
from zenocap.tools.option_groups import EXPERT, option
from zenocap.tools.service_arguments import ServiceArguments, words

if TYPE_CHECKING:  # imported where it is used: `zenocap --help` answers at once
    from zenocap.common.rig.rig import Rig

OptionalRig = Annotated[
    Path | None,
    typer.Argument(
        metavar="[RIG]", help="Rig file (TOML), or folder with calibration.toml and videos/; none with --discover."
    ),
]


@dataclass(frozen=True)
class ViewerArguments:
    """A viewer of a rig, or the cameras of this machine."""

    id: str | None = option(None, "Id of the viewer in the rig file.")
    discover: bool = option(
        False, "Announce the cameras of this machine; let `zenocap film` record and `zenocap up` use them."
    )
    camera: list[str] | None = option(
        None,
        "With --discover, or for a rig's discover:MACHINE/NAME: a further camera or stream; may be repeated.",
        metavar="NAME=SOURCE",
    )
    machine: str | None = option(None, "With --discover: name of this machine; default: its host name.", metavar="NAME")
    allow_preview: bool = option(
        False, "With --discover: let rigs with `preview = true` show small pictures, to every program in the network."
    )

    def check(self, rig: Path | None, assigned: Path | None) -> None:
        """Raises typer.BadParameter for arguments that exclude or need each other."""
        has_both = rig is not None and self.id is not None
        wrong = {
            "--discover: allowed without RIG and --id": self.discover and (rig is not None or self.id is not None),
            "RIG and --id are missing: allowed: both, or --discover": not (self.discover or assigned or has_both),
            "--machine: allowed with --discover": self.machine and not self.discover,
            "--allow-preview: allowed with --discover; a rig file has preview": self.allow_preview and not self.discover,
        }
        refuse(wrong)


@dataclass(frozen=True)
class FilmingArguments:
    """Options of the films that are recorded for `zenocap film`, and hidden ones of the processes that zenocap starts."""

    films: Path | None = option(
        None, "Folder of the films of `zenocap film`; default: films beside the rig file, or here.", metavar="FOLDER"
    )
    epoch_ns: int | None = option(None, "", hidden=True)
    assigned: Path | None = option(None, "Saved assignment of a --discover process.", hidden=True)


def viewer(
    rig: OptionalRig = None, *, given: ViewerArguments, filming: Annotated[FilmingArguments, EXPERT],
    arguments: ServiceArguments,
) -> None:  # fmt: skip
    """Run one viewer of a rig, or announce the cameras of a machine.

    A viewer makes silhouettes, sightings and joint angles of a camera's images. Run it on the camera's machine, before
    or after the other services; images stay there. It ends with Ctrl-C, or with its video. Viewers of videos agree on a
    common start.

    With --discover it needs no rig file: it announces the cameras of this machine (`zenocap cameras --discover` lists
    them), records those that `zenocap film` asks for into its folder of films, and runs the viewers of a rig whose file
    has `source = "discover:MACHINE/CAMERA"`, while `zenocap up` runs there. Everybody on the network can then do this.

    Example, on two machines: `zenocap viewer studio.toml --id 1`, `zenocap viewer studio.toml --id 2`
    """
    id, cameras = given.id, given.camera or ()
    given.check(rig, filming.assigned)
    name = "cameras" if given.discover else f"viewer {id}" if id else "viewer"
    with one_line_errors(), arguments.running(name) as stopped:
        if given.discover:
            raise typer.Exit(_discovering(given, filming, arguments, stopped))
        from zenocap.services.camera.endpoint import filming_of
        from zenocap.services.viewer.shell import run_viewer
        from zenocap.tools.cli.calibrate.board_options import detect_command

        if filming.assigned is not None:
            from zenocap.services.camera.saved import saved_rig
            from zenocap.services.viewer.sources.device import of_working_size

            one, id = saved_rig(filming.assigned, filming.films or Path())
            options, epoch_ns, opener = arguments.options(), None, of_working_size(one.viewer(id))
        else:
            assert rig is not None
            assert id is not None
            one = _with_own_camera(rig_at(rig, files=False), id, cameras)
            options, epoch_ns, opener = arguments.options(one, f"viewer-{id}"), filming.epoch_ns, None
        filmed = filming_of(one, id, filming.films, secured=options.security is not None, detect=detect_command)
        raise typer.Exit(run_viewer(one, id, options, stopped, epoch_ns, filmed, opener))


def _discovering(
    given: ViewerArguments, filming: FilmingArguments, arguments: ServiceArguments, stopped: Callable[[], bool]
) -> int:
    """Announce the cameras of this machine, film with them, and run viewers for others; the exit status."""
    from zenocap.services.camera.parameters import FILMS
    from zenocap.services.camera.shell import run_host
    from zenocap.services.viewer.sources.source import images_of
    from zenocap.tools.cli.calibrate.board_options import detect_command

    folder = filming.films or Path(FILMS)
    return run_host(
        given.machine, given.camera or (), folder, arguments.options(), stopped, images_of,
        allow_preview=given.allow_preview, command=partial(_assigned_command, arguments, folder), detect=detect_command,
    )  # fmt: skip


def _with_own_camera(rig: Rig, id: str, named: Sequence[str]) -> Rig:
    """The rig, with the camera of this machine where viewer `id` has an announced one.  named: NAME=SOURCE of cameras.

    Raises UserError.
    """
    from zenocap.common.rig.sources import Announced
    from zenocap.services.camera.host_cameras import own_camera

    own = rig.viewer(id)
    if not isinstance(own.source, Announced):
        if named:
            raise UserError('--camera: allowed with --discover, or for a viewer with source = "discover:MACHINE/CAMERA"')
        return rig
    viewer = replace(own, source=own_camera(own.source, named))
    return replace(rig, viewers=tuple(viewer if one is own else one for one in rig.viewers))


def _assigned_command(arguments: ServiceArguments, films: Path, file: Path) -> list[str]:
    """Command of the viewer of a saved assignment: it connects where this process does, and to this process."""
    near = [one.replace("/0.0.0.0:", "/127.0.0.1:").replace("/[::]:", "/[::1]:") for one in arguments.listen or ()]
    connect, mode = [*(arguments.connect or ()), *near], "client" if arguments.mode == "router" else arguments.mode
    arguments = replace(arguments, mode=mode, connect=connect, listen=None, with_parent=True)
    return words(("viewer", MAIN), None, arguments, "--assigned", str(file), "--films", str(films))
