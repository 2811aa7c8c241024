"""The command that guides through the set-up of a rig on this machine: setup."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.tools.cli.options import DONE, FAILED, LOSS, one_line_errors

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.tools.setup.state import Cameras, Step

TITLES: dict[str, str] = {
    "cameras": "which cameras",
    "look": "pictures, focus, light",
    "calibration": "lenses and places of the cameras",
    "rig": "the rig file",
    "take": "background, T-pose, first take",
}
LEAVE = "left: the same command goes on here"
StepOption = Literal["cameras", "look", "calibration", "rig", "take"]


def setup(
    folder: Annotated[Path, typer.Argument(help="Folder of the rig; made by the first step.", show_default=False)],
    cameras: Annotated[
        list[str] | None,
        typer.Argument(metavar="NAME=SOURCE...", help="The cameras, instead of the question for them.", show_default=False),
    ] = None,
    size: Annotated[str, typer.Option(metavar="WxH", help="Size of the images (px) that is requested.")] = "1280x720",
    fps: Annotated[float, typer.Option(min=1.0, max=240.0, help="Frames/s that are requested.")] = 30.0,
    again: Annotated[
        StepOption | None, typer.Option(help="Begin again with this step; what the later ones left stays.")
    ] = None,
    status: Annotated[bool, typer.Option("--status", help="Print what is done, and end.")] = False,
    seconds: Annotated[
        float | None,
        typer.Option(min=1.0, help="Length of the first take (s); default: until Ctrl-C.", show_default=False),
    ] = None,
) -> None:
    """Set up a rig of cameras at this machine, step by step: cameras, focus and light, calibration, rig file, first take.

    Every step says what to do, runs the command for it and shows what came out; a step can be repeated. Ctrl-D leaves; the
    same command goes on where it was left, because each step leaves a file in the folder: cameras.toml, calibration.toml,
    rig.toml, recordings.

    Exit status 3 with --status: there are steps left.

    Examples: `zenocap setup studio`, `zenocap setup studio left=/dev/video0 right=/dev/video2`,
    `zenocap setup studio --status`
    """
    from zenocap.common.errors import UserError
    from zenocap.tools.cli.track import parsed_size
    from zenocap.tools.setup.state import STEPS, next_step

    with one_line_errors():
        if folder.exists() and not folder.is_dir():
            raise UserError(f"{folder}: a file: allowed: a folder, which may be new")
        if status:
            raise typer.Exit(_status(folder))
        if cameras:
            _write_cameras(folder, cameras, parsed_size(size), fps)
        step = again or next_step(folder)
        if again and again != "cameras":
            _check_reached(folder, again)
        while step is not None:
            typer.echo(f"\nStep {STEPS.index(step) + 1} of {len(STEPS)}: {TITLES[step]}")
            try:
                _run(step, folder, parsed_size(size), fps, seconds)
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


def _status(folder: Path) -> int:
    from zenocap.tools.setup.state import STEPS, next_step

    step = next_step(folder)
    left = STEPS.index(step) if step else len(STEPS)
    for k, one in enumerate(STEPS):
        typer.echo(f"{'done' if k < left else 'next' if k == left else '    '}  {one}: {TITLES[one]}")
    return DONE if step is None else LOSS


def _check_reached(folder: Path, step: Step) -> None:
    """Refuse a step whose earlier ones are not done.  Raises UserError."""
    from zenocap.common.errors import UserError
    from zenocap.tools.setup.state import STEPS, next_step

    reached = next_step(folder)
    if reached is not None and STEPS.index(reached) < STEPS.index(step):
        raise UserError(f"--again {step}: {reached} is not done: allowed: {', '.join(STEPS[: STEPS.index(reached) + 1])}")


def _run(step: Step, folder: Path, size: tuple[int, int], fps: float, seconds: float | None) -> None:
    from zenocap.tools.setup.state import read_cameras

    if step == "cameras":
        _ask_cameras(folder, size, fps)
        return
    known = read_cameras(folder)
    assert known is not None
    match step:
        case "look":
            _look(folder, known)
        case "calibration":
            _calibrate(folder, known)
        case "rig":
            _write_rig(folder, known)
        case "take":
            _take(folder, seconds)


def _command(*words: str) -> int:
    """Run a zenocap command in this terminal; its exit status.  Ctrl-C ends the command and not the set-up."""
    import signal
    import subprocess
    import sys

    from zenocap.common.rig.sources import without_password

    shown = []
    for word in words:
        name, equals, source = word.partition("=")
        shown.append(f"{name}{equals}{without_password(source)}")
    typer.echo(f"$ zenocap {' '.join(shown)}")
    before = signal.signal(signal.SIGINT, lambda *_: None)  # the command receives it from the terminal itself
    try:
        # -P: without the user's folder among the modules.
        return subprocess.call([sys.executable, "-P", "-m", "zenocap", *words])
    finally:
        signal.signal(signal.SIGINT, before)


def _ask_cameras(folder: Path, size: tuple[int, int], fps: float) -> None:
    """Ask for a name of each camera of this machine, and for streams."""
    from zenocap.common.errors import UserError
    from zenocap.common.video.v4l2.listing import found_cameras
    from zenocap.tools.setup.state import named

    try:
        found = [one for one in found_cameras() if not one.problem]
    except UserError as error:
        typer.echo(f"{error}")
        found = []
    chosen: list[str] = []
    for camera in found:
        modes = ", ".join(f"{mode.format} {mode.size[0]}x{mode.size[1]}" for mode in camera.modes[:4])
        typer.echo(f"{camera.name} ({modes}): {camera.source}")
        name = typer.prompt("its name in the rig, such as left; - leaves it out", default=f"cam{len(chosen) + 1:02}")
        if name != "-":
            chosen.append(f"{name}={camera.source}")
    typer.echo("network cameras, as NAME=rtsp://USER:PASSWORD@HOST/STREAM, one a line; an empty line ends")
    while text := typer.prompt("camera", default="", show_default=False):
        try:
            named(text)
        except UserError as error:
            typer.echo(f"{error}")
            continue
        chosen.append(text)
    _write_cameras(folder, chosen, size, fps, new=False)


def _write_cameras(folder: Path, texts: list[str], size: tuple[int, int], fps: float, *, new: bool = True) -> None:
    """Write the cameras NAME=SOURCE.  new: refuse to replace earlier ones.  Raises UserError."""
    from zenocap.common.errors import UserError
    from zenocap.tools.setup.state import CAMERAS, Cameras, named, write_cameras

    pairs = [named(text) for text in texts]
    sources = dict(pairs)
    if len(sources) < 2 or len(sources) < len(pairs) or len(set(sources.values())) < len(sources):
        raise UserError(f"{len(pairs)} camera(s): {', '.join(sources) or 'none'}: allowed: two or more, each once")
    if new and (folder / CAMERAS).is_file():
        raise UserError(f"{folder / CAMERAS}: exists already: allowed: another folder, or --again cameras")
    write_cameras(folder, Cameras(sources, size, fps))
    typer.echo(f"written: {folder / CAMERAS}: {', '.join(sources)}")


def _named_sources(known: Cameras) -> list[str]:
    return [f"{name}={source}" for name, source in known.sources.items()]


def _shape(known: Cameras) -> list[str]:
    return ["--size", f"{known.size[0]}x{known.size[1]}", "--fps", f"{known.fps:g}"]


def _look(folder: Path, known: Cameras) -> None:
    from dataclasses import replace

    from zenocap.tools.setup.state import write_cameras

    typer.echo(
        "Place the cameras around the area, at half the height of the room: two at right angles, or several around it. A\n"
        "person must be seen from head to feet in all of it. The page shows pictures, focus, light and noise, and advice.\n"
        "Ctrl-C when all is right."
    )
    if typer.confirm("show the cameras?", default=True):
        _command("cameras", "--live", *_named_sources(known), *_shape(known))
        if not typer.confirm("are the pictures right?", default=True):
            return
    write_cameras(folder, replace(known, looked=True))


def _calibrate(folder: Path, known: Cameras) -> None:
    from zenocap.tools.setup.state import CALIBRATION, check_calibration

    output = folder / CALIBRATION
    typer.echo(
        "b  with a printed board: lenses, places and floor; most exact. To print: zenocap calibrate print -o board.pdf\n"
        "w  with a person who walks about, if the lenses are known\n"
        "f  there is a calibration file for these cameras"
    )
    kind = _choice("which", "b", "w", "f")
    new = output.with_name(f"new-{CALIBRATION}")
    if kind == "b":
        square = typer.prompt("side of a square of the print, measured with a ruler, mm", type=float)
        words = ["--square", f"{square:g}", "-o", str(new), "--force"]
        code = _command("calibrate", "board", "--live", *_named_sources(known), *words, *_shape(known))
    elif kind == "w":
        lenses = _file("file with the lenses")
        height = typer.prompt("height of the person in shoes, m", type=float)
        typer.echo("Leave the scene empty for 3 s, then walk about in curves for half a minute; the film takes 40 s.")
        typer.prompt("Enter begins", default="", show_default=False)
        film = folder / "walk"
        code = _command("film", *_named_sources(known), "-o", str(film), "--seconds", "40", "--force", *_shape(known))
        if code in (DONE, LOSS):
            (film / "clip.toml").write_text(f"empty_frames = {round(2.0 * known.fps)}\n", encoding="utf-8")
            words = ["--height", f"{height:g}", "--lenses", lenses, "-o", str(new), "--force"]
            code = _command("calibrate", "walk", str(film), *words)
    else:
        code = _command("calibrate", "convert", _file("file"), "-o", str(new), "--force")
    if code not in (DONE, LOSS) or not new.is_file():
        new.unlink(missing_ok=True)
        return
    if code == LOSS and not typer.confirm("the result is poor; use it all the same?", default=False):
        return
    new.replace(output)
    try:
        check_calibration(folder, known)
    except Exception:
        output.replace(new)
        raise
    typer.echo(f"written: {output}")


def _write_rig(folder: Path, known: Cameras) -> None:
    from zenocap.common.atomic_write import write_atomically
    from zenocap.tools.setup.state import RIG, rig_text

    path = folder / RIG
    if path.is_file() and not typer.confirm(f"{path} exists; write it anew?", default=False):
        return
    write_atomically(path, rig_text(folder.resolve().name, known).encode())
    path.chmod(0o600)  # sources may have passwords
    typer.echo(f"written: {path}; docs/machines.md says how cameras at other machines are added")


def _take(folder: Path, seconds: float | None) -> None:
    from zenocap.tools.setup.state import RIG, TAKES, takes_in

    typer.echo(
        "The rig starts, with its page. Leave the area empty for the first 3 s; then stand in the middle with the arms\n"
        "stretched sideways until the page shows the body, and move. Under Set-up the page says for each camera what is\n"
        "not right. Ctrl-C ends the take."
    )
    typer.prompt("Enter begins", default="", show_default=False)
    length = [] if seconds is None else ["--seconds", f"{seconds:g}"]
    _command("up", str(folder / RIG), "--recordings", str(folder / TAKES), *length)
    if takes := takes_in(folder):
        _command("info", str(takes[-1]))


def _finished(folder: Path) -> None:
    from zenocap.tools.setup.state import RIG, takes_in

    last = takes_in(folder)[-1]
    typer.echo(
        f"\nThe set-up is done. From now on: zenocap up {folder / RIG}\n"
        f"look at the take: zenocap show {last}\n"
        f"check the cameras any day, from any take of a walk: zenocap calibrate drift {last}"
    )


def _choice(question: str, *values: str) -> str:
    """Ask until the answer is one of the values; the first is the default."""
    while (answer := str(typer.prompt(question, default=values[0]))) not in values:
        typer.echo(f"{answer}: allowed: {', '.join(values)}")
    return answer


def _file(question: str) -> str:
    """Ask until the answer is a file or folder that exists."""
    while not Path(answer := str(typer.prompt(question))).exists():
        typer.echo(f"{answer}: no such file")
    return answer
