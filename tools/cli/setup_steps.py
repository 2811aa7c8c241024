"""Steps of the guided set-up: questions, command and files of each."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from zenocap.tools.cli.options import DONE, LOSS

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.tools.setup.state import Cameras


def _command(*words: str) -> int:
    """Run a zenocap command in this terminal; its exit status.  Ctrl-C ends the command and not the set-up.

    In a process of its own: such a command takes cameras, threads and Ctrl-C, and gives all back only when it ends.
    """
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


def _named_sources(known: Cameras) -> list[str]:
    return [f"{name}={source}" for name, source in known.sources.items()]


def _shape(known: Cameras) -> list[str]:
    return ["--size", f"{known.size[0]}x{known.size[1]}", "--fps", f"{known.fps:g}"]


def look(folder: Path, known: Cameras) -> None:
    """Show the cameras of this machine on a page."""
    from dataclasses import replace

    from zenocap.tools.setup.state import write_cameras

    typer.echo(
        "Place the cameras around the area, at half the height of the room: two at right angles, or several around it. A\n"
        "person must be seen from head to feet in all of it. The page shows pictures, focus, light and noise, and advice.\n"
        "Ctrl-C when all is right."
    )
    away = known.away
    for name, source in away.items():
        typer.echo(f"{name}: pictures stay on {source.machine}: there, run: zenocap cameras --live")
    own = [one for one in _named_sources(known) if one.partition("=")[0] not in away]
    if own and typer.confirm("show the cameras?", default=True):
        _command("cameras", "--live", *own, *_shape(known))
        if not typer.confirm("are the pictures right?", default=True):
            return
    elif not own and not typer.confirm("are the pictures right?", default=True):
        return
    write_cameras(folder, replace(known, looked=True))


def calibrate(folder: Path, known: Cameras) -> None:
    """Calibrate in one of three ways; leaves the calibration, or nothing."""
    from zenocap.tools.setup.state import CALIBRATION, check_calibration

    output = folder / CALIBRATION
    typer.echo(
        "b  with a printed board: lenses, places and floor; most exact. To print: zenocap calibrate print -o board.pdf\n"
        "w  with a person who walks about, if the lenses are known\n"
        "f  there is a calibration file for these cameras"
    )
    kind = _choice("which", "b", "w", "f")
    new = output.with_name(f"new-{CALIBRATION}")
    match kind:
        case "b":
            code = _with_board(folder, known, new)
        case "w":
            code = _with_walker(folder, known, new)
        case _:
            code = _command("calibrate", "convert", _file("file"), "-o", str(new), "--force")
    if code not in (DONE, LOSS) or not new.is_file():
        new.unlink(missing_ok=True)
        return
    if code == LOSS and not typer.confirm("the result is poor; use it all the same?", default=False):
        return
    _match_names(new, known)
    known = _matched_size(folder, new, known)
    try:
        check_calibration(new, known)
        new.replace(output)
    finally:
        new.unlink(missing_ok=True)
    typer.echo(f"written: {output}")


def _match_names(path: Path, known: Cameras) -> None:
    """Ask which camera of a calibration is which, where it has other names, and write it with those of the set-up."""
    from dataclasses import replace

    from zenocap.common.camera.calibration_files import read_calibration, write_calibration

    calibrated = read_calibration(path)
    missing = [name for name in known.sources if name not in calibrated]
    others = [name for name in calibrated if name not in known.sources]
    if not missing or len(others) < len(missing):
        return
    typer.echo(f"the calibration has other names of cameras: {', '.join(others)}")
    names = {name: name for name in known.sources if name in calibrated}
    for name in missing:
        names[name] = _choice(f"which of them is {name} ({', '.join(others)})", *others)
        others.remove(names[name])
    write_calibration(path, {name: replace(calibrated[other], name=name) for name, other in names.items()})


def _matched_size(folder: Path, path: Path, known: Cameras) -> Cameras:
    """The cameras with the size of their calibration, where it has another shape and the user wants that."""
    from dataclasses import replace

    from zenocap.common.camera.calibration_files import read_calibration
    from zenocap.tools.setup.state import has_shape, write_cameras

    sizes = {camera.size for name, camera in read_calibration(path).items() if name in known.sources}
    if len(sizes) != 1 or has_shape(known.size, size := sizes.pop()):
        return known
    question = (
        f"the calibration is for images of {size[0]} x {size[1]}, of another shape than the {known.size[0]} x "
        f"{known.size[1]} that are requested from the cameras; request {size[0]} x {size[1]}?"
    )
    if not typer.confirm(question, default=True):
        return known
    known = replace(known, size=size)
    write_cameras(folder, known)
    return known


def _with_board(folder: Path, known: Cameras, new: Path) -> int:
    """Status of the calibration with a board: live, or from a film where cameras are on other machines."""
    square = typer.prompt("side of a square of the print, measured with a ruler, mm", type=float)
    words = ["--square", f"{square:g}", "-o", str(new), "--force"]
    if not known.away:
        return _command("calibrate", "board", "--live", *_named_sources(known), *words, *_shape(known))
    typer.echo(
        "The cameras of other machines are filmed there, and the board is searched there: only its corners are copied.\n"
        "Move the board slowly through the room, tilt it, show it to two or more cameras at once, lay it on the floor at\n"
        "last; Ctrl-C ends the film."
    )
    typer.prompt("Enter begins", default="", show_default=False)
    film = folder / "board"
    code = _film(film, known, "--square", f"{square:g}")
    return _command("calibrate", "board", str(film), *words) if code in (DONE, LOSS) else code


def _with_walker(folder: Path, known: Cameras, new: Path) -> int:
    """Status of the calibration with a person."""
    from zenocap.tools.setup.cameras.away import away_text

    lenses = _file("file with the lenses")
    height = typer.prompt("height of the person in shoes, m", type=float)
    typer.echo("Leave the scene empty for 3 s, then walk about in curves for half a minute; the film takes 40 s.")
    typer.prompt("Enter begins", default="", show_default=False)
    film = folder / "walk"
    code = _film(film, known, "--seconds", "40")
    if code not in (DONE, LOSS):
        return code
    while text := away_text(film):
        typer.echo(text)
        typer.prompt("Enter goes on when they are copied", default="", show_default=False)
    (film / "clip.toml").write_text("empty_seconds = 2.0\n", encoding="utf-8")
    words = ["--height", f"{height:g}", "--lenses", lenses, "-o", str(new), "--force"]
    return _command("calibrate", "walk", str(film), *words)


def _film(folder: Path, known: Cameras, *words: str) -> int:
    """Status of a film of all cameras."""
    away = known.network.words() if known.away else []
    return _command("film", *_named_sources(known), "-o", str(folder), "--force", *words, *away, *_shape(known))


def write_rig(folder: Path, known: Cameras) -> None:
    """Write the rig file."""
    from zenocap.common.atomic_write import write_atomically
    from zenocap.tools.setup.state import RIG, rig_text

    path = folder / RIG
    if path.is_file() and not typer.confirm(f"{path} exists; write it anew?", default=False):
        return
    write_atomically(path, rig_text(folder.resolve().name, known).encode())
    path.chmod(0o600)  # sources may have passwords
    typer.echo(f"written: {path}")
    if machines := sorted({one.machine for one in known.away.values()}):
        typer.echo(
            f"its viewers on {', '.join(machines)} are started by `zenocap up`, while zenocap viewer --discover runs there"
        )


def take(folder: Path, seconds: float | None) -> None:
    """Run the rig for a take."""
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
