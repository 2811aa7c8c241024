"""The command that guides through the set-up of a rig: setup."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.common.errors import UserError
from zenocap.tools.cli.options import DONE, FAILED, LOSS, one_line_errors, parsed_size
from zenocap.tools.option_groups import option
from zenocap.tools.service_arguments import ZenohArguments

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.tools.setup.network import Network
    from zenocap.tools.setup.state import Step

TITLES: dict[str, str] = {
    "cameras": "which cameras", "look": "pictures, focus, light", "calibration": "lenses and places of the cameras",
    "rig": "the rig file", "take": "background, T-pose, first take",
}  # fmt: skip
LEAVE = "left: the same command goes on here"
StepOption = Literal["cameras", "look", "calibration", "rig", "take"]

Folder = Annotated[Path, typer.Argument(help="Folder of the rig; made by the first step.")]
NamedCameras = Annotated[
    list[str] | None, typer.Argument(metavar="NAME=SOURCE...", help="The cameras, instead of the question for them.")
]


@dataclass(frozen=True)
class SetupArguments:
    """size, fps: of the images that are requested.  again: step to begin with.  seconds: of the first take."""

    size: str = option("1280x720", "Size of the images (px) that is requested.", metavar="WxH")
    fps: float = option(30.0, "Frames/s that are requested.", min=1.0, max=240.0)
    again: StepOption | None = option(None, "Begin again with this step; what the later ones left stays.")
    status: bool = option(False, "Print what is done, and end.")
    seconds: float | None = option(None, "Length of the first take (s); default: until Ctrl-C.", min=1.0)


def setup(folder: Folder, cameras: NamedCameras = None, *, given: SetupArguments, zenoh: ZenohArguments) -> None:
    """Set up a rig step by step, from its cameras to a first take.

    The steps: cameras, focus and light, calibration, rig file, first take. Every step says what to do, runs the command
    for it and shows what came out; a step can be repeated. Ctrl-D leaves; the same command goes on where it was left,
    because each step leaves a file in the folder: cameras.toml, calibration.toml, rig.toml, recordings.

    Cameras of other machines: run `zenocap viewer --discover` there. They are listed, and their source is
    discover:MACHINE/CAMERA. Zenoh options of the first step are kept for the later ones and written into the rig file.
    Films of a person who walks are copied by you, with the commands that are printed.

    Exit status 3 with --status: there are steps left.

    Examples: `zenocap setup studio`, `zenocap setup studio left=/dev/video0 right=/dev/video2`,
    `zenocap setup studio --status`
    """
    from zenocap.tools.setup.state import STEPS, next_step

    with one_line_errors():
        if folder.exists() and not folder.is_dir():
            raise UserError(f"{folder}: a file: allowed: a folder, which may be new")
        if given.status:
            raise typer.Exit(_status(folder))
        step = _first_step(folder, cameras, given, zenoh)
        while step is not None:
            typer.echo(f"\nStep {STEPS.index(step) + 1} of {len(STEPS)}: {TITLES[step]}")
            try:
                _run(step, folder, given, zenoh)
            except (typer.Abort, EOFError):
                typer.echo(f"\n{LEAVE}: zenocap setup {folder}")
                raise typer.Exit(FAILED) from None
            following = next_step(folder)
            if following == step:
                typer.echo(f"not done; {LEAVE}: zenocap setup {folder}")
                raise typer.Exit(FAILED)
            step = following
        _finished(folder)
    raise typer.Exit(DONE)


def _first_step(folder: Path, cameras: list[str] | None, given: SetupArguments, zenoh: ZenohArguments) -> Step | None:
    """The step to begin with, None when all are done; given cameras are saved.  Raises UserError."""
    from zenocap.tools.setup.network import OPEN, Network
    from zenocap.tools.setup.state import next_step

    network = Network.of(zenoh)
    if cameras:
        save_cameras(folder, cameras, parsed_size(given.size), given.fps, network)
    step = given.again or next_step(folder)
    if step != "cameras" and not cameras and network != OPEN:
        raise UserError("Zenoh options: allowed: with the first step, which keeps them, or with --again cameras")
    if given.again and given.again != "cameras":
        _check_reached(folder, given.again)
    return step


def _status(folder: Path) -> int:
    from zenocap.tools.setup.state import STEPS, reached_step

    step = reached_step(folder)
    left = STEPS.index(step) if step else len(STEPS)
    for k, one in enumerate(STEPS):
        typer.echo(f"{'done' if k < left else 'next' if k == left else '    '}  {one}: {TITLES[one]}")
    return DONE if step is None else LOSS


def _check_reached(folder: Path, step: Step) -> None:
    """Refuse a step whose earlier ones are not done.  Raises UserError."""
    from zenocap.tools.setup.state import STEPS, reached_step

    reached = reached_step(folder)
    if reached is not None and STEPS.index(reached) < STEPS.index(step):
        raise UserError(f"--again {step}: {reached} is not done: allowed: {', '.join(STEPS[: STEPS.index(reached) + 1])}")


def _run(step: Step, folder: Path, given: SetupArguments, zenoh: ZenohArguments) -> None:
    from zenocap.tools.cli.setup_steps import calibrate, look, take, write_rig
    from zenocap.tools.setup.network import Network
    from zenocap.tools.setup.state import read_cameras

    if step == "cameras":
        ask_cameras(folder, parsed_size(given.size), given.fps, Network.of(zenoh), zenoh)
        return
    known = read_cameras(folder)
    assert known is not None
    match step:
        case "look":
            look(folder, known)
        case "calibration":
            calibrate(folder, known)
        case "rig":
            write_rig(folder, known)
        case "take":
            take(folder, given.seconds)


def _finished(folder: Path) -> None:
    from zenocap.tools.setup.state import RIG, takes_in

    last = takes_in(folder)[-1]
    typer.echo(
        f"\nThe set-up is done. From now on: zenocap up {folder / RIG}\n"
        f"look at the take: zenocap show {last}\n"
        f"check the cameras any day, from any take of a walk: zenocap calibrate drift {last}"
    )


def ask_cameras(folder: Path, size: tuple[int, int], fps: float, network: Network, zenoh: ZenohArguments) -> None:
    """Ask for a name of each camera of this machine and of other machines, and for streams."""
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
    from zenocap.tools.setup.state import CAMERAS, Cameras, named, write_cameras

    pairs = [named(text) for text in texts]
    sources = dict(pairs)
    if len(sources) < 2 or len(sources) < len(pairs) or len(set(sources.values())) < len(sources):
        raise UserError(f"{len(pairs)} camera(s): {', '.join(sources) or 'none'}: allowed: two or more, each once")
    if new and (folder / CAMERAS).is_file():
        raise UserError(f"{folder / CAMERAS}: exists already: allowed: another folder, or --again cameras")
    write_cameras(folder, Cameras(sources, size, fps, network=network))
    typer.echo(f"written: {folder / CAMERAS}: {', '.join(sources)}")
