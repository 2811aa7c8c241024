"""First step of the guided set-up: cameras of this machine, of others, and of the network."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.tools.service_arguments import ZenohArguments
    from zenocap.tools.setup.network import Network


def ask_cameras(folder: Path, size: tuple[int, int], fps: float, network: Network, zenoh: ZenohArguments) -> None:
    """Ask for a name of each camera of this machine and of other machines, and for streams."""
    from zenocap.common.errors import UserError
    from zenocap.common.runtime.foreign_text import printable
    from zenocap.tools.setup.state import named

    chosen: list[str] = []
    for title, source, suggestion in (*_own(), *_announced(zenoh)):
        typer.echo(printable(title))
        taken = [one.partition("=")[0] for one in chosen]
        default = suggestion if suggestion and suggestion not in taken else f"cam{len(chosen) + 1:02}"
        name = typer.prompt("its name in the rig, such as left; - leaves it out", default=default)
        if name != "-":
            chosen.append(f"{name}={source}")
    typer.echo("network cameras, as NAME=rtsp://USER:PASSWORD@HOST/STREAM, one a line; an empty line ends")
    while text := typer.prompt("camera", default="", show_default=False):
        try:
            named(text)
        except UserError as error:
            typer.echo(f"{error}")
            continue
        chosen.append(text)
    save_cameras(folder, chosen, size, fps, network, new=False)


def _own() -> list[tuple[str, str, str]]:
    """Title, source and suggested name of each camera of this machine."""
    from zenocap.common.errors import UserError
    from zenocap.common.video.v4l2.listing import found_cameras

    try:
        found = [one for one in found_cameras() if not one.problem]
    except UserError as error:
        typer.echo(f"{error}")
        return []
    rows = []
    for camera in found:
        modes = ", ".join(f"{mode.format} {mode.size[0]}x{mode.size[1]}" for mode in camera.modes[:4])
        rows.append((f"{camera.name} ({modes}): {camera.source}", camera.source, ""))
    return rows


def _announced(zenoh: ZenohArguments) -> list[tuple[str, str, str]]:
    """The same of each camera that another machine announces."""
    import time

    from zenocap.common.bus.protocol import BusError
    from zenocap.common.bus.zenoh_film import FilmSession
    from zenocap.common.rig.sources import Announced
    from zenocap.tools.setup.cameras.hosts import PATIENCE_S, announced, host_problem

    typer.echo("looking for machines on which `zenocap viewer --discover` runs ...")
    end_s = time.monotonic() + PATIENCE_S
    try:
        with FilmSession.open(zenoh.options(), lambda: time.monotonic() > end_s) as session:
            hosts = announced(session)
    except BusError as error:
        typer.echo(f"{error}")
        return []
    rows = []
    for host in hosts:
        for camera in host.cameras:
            source = Announced(host.machine, camera.id)
            problem = host_problem(source, hosts) or (f"in use by {camera.used_by}" if camera.used_by else "")
            title = f"{host.machine}: {camera.name or camera.id} ({camera.source})"
            if problem:
                typer.echo(f"{title}: left out: {problem}")
            else:
                rows.append((title, source.text, camera.id if len(camera.id) < 20 else ""))
    return rows


def save_cameras(
    folder: Path, texts: list[str], size: tuple[int, int], fps: float, network: Network, *, new: bool = True
) -> None:
    """Write the cameras NAME=SOURCE.  new: refuse to replace earlier ones.  Raises UserError."""
    from zenocap.common.errors import UserError
    from zenocap.tools.setup.state import CAMERAS, Cameras, named, write_cameras

    pairs = [named(text) for text in texts]
    sources = dict(pairs)
    if len(sources) < 2 or len(sources) < len(pairs) or len(set(sources.values())) < len(sources):
        raise UserError(f"{len(pairs)} camera(s): {', '.join(sources) or 'none'}: allowed: two or more, each once")
    if new and (folder / CAMERAS).is_file():
        raise UserError(f"{folder / CAMERAS}: exists already: allowed: another folder, or --again cameras")
    write_cameras(folder, Cameras(sources, size, fps, network=network))
    typer.echo(f"written: {folder / CAMERAS}: {', '.join(sources)}")
