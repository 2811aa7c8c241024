"""The command that finds when the videos of a rig begin: sync."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from zenocap.tools.cli.options import DONE, LOSS, camera_list, one_line_errors, rig_at
from zenocap.tools.cli.progress import progress
from zenocap.tools.option_groups import option

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.rig.rig import Rig
    from zenocap.tools.setup.sync.synchronize import CameraOffset

RigOrTake = Annotated[
    Path,
    typer.Argument(
        metavar="RIG", help="Rig file (TOML), folder with calibration.toml and videos/, or a take (MCAP) of live cameras."
    ),
]
UNITS = {"sound": "ms between windows", "flash": "ms between flashes", "silhouettes": "px between outlines"}
ADVICE = (
    "nothing is written unless all offsets are certain; what helps: sound in every video, a clap, a flash, a "
    "longer video in which the person walks and is seen whole by all cameras"
)


@dataclass(frozen=True)
class SyncArguments:
    """by: what is compared.  cameras: text with commas."""

    by: Literal["auto", "sound", "flash", "silhouettes"] = option(
        "auto", "What is compared; auto: sound; without it, the more exact of flashes and silhouettes."
    )
    max_offset: float = option(10.0, "Largest difference of the times at which two videos begin (s).", min=0.1, max=3600)
    seconds: float = option(120.0, "Length of the part of each video to use, from its beginning (s).", min=2, max=3600)
    cameras: str | None = option(
        None,
        "Compare these cameras only, such as cam01,cam03; two or more. Offsets of others in sync.toml stay.",
        metavar="NAME,NAME...",
    )
    dry_run: bool = option(False, "Print the offsets and write nothing.")


def sync(rig: RigOrTake, *, given: SyncArguments) -> None:
    """Find the times at which the videos of a rig begin.

    They are written into FOLDER/sync.toml; of a rig file, they are printed. Sound is compared by the phases of its
    spectrum; a clap, speech or steps suffice. Without sound, a flash or a lamp that is switched shows in all videos, as
    a change of the whole image. And the outlines of the person are compared: planes through two cameras that touch the
    person touch the outline in both views at equal times. This needs the calibration and a person who moves. An
    existing sync.toml is replaced.

    Sound takes 3 ms per metre: it puts a camera that is 5 m farther from the source 15 ms too early.

    Of a take (MCAP) of live cameras it prints the delay of each camera, from the silhouettes of the first 20 s, as
    `delay_ms` of the rig file; the other options do not matter.

    Exit status 3: an offset is not certain, and nothing is written.

    Example: `zenocap sync walk`, then `zenocap track walk -o walk.mcap`
    """
    with one_line_errors():
        if rig.suffix.lower() == ".mcap":
            _sync_take(rig)
        from zenocap.common.runtime import logs
        from zenocap.tools.setup.sync.synchronize import SyncOptions, synchronize

        logs.configure("sync")
        one = rig_at(rig, files=True, cameras=camera_list(given.cameras))
        with progress("comparing the videos") as state:
            found, notes = synchronize(one, SyncOptions(given.by, given.max_offset, given.seconds), state.update)
        for note in notes:
            typer.echo(f"note: {note}", err=True)
        for id, camera in found.items():
            typer.echo(line_of(one, id, camera))
        uncertain = [id for id, camera in found.items() if not camera.is_certain]
        if uncertain:
            typer.echo(f"not certain: {', '.join(uncertain)}: {ADVICE}", err=True)
            raise typer.Exit(LOSS)
        _write(rig, found, given)
    raise typer.Exit(DONE)


def _write(rig: Path, found: Mapping[str, CameraOffset], given: SyncArguments) -> None:
    """Write the offsets into a folder of videos; print those of a rig file, or that are not to be written.

    Raises UserError.
    """
    from zenocap.tools.setup.sync.synchronize import sync_text, write_sync

    sources = " and ".join(dict.fromkeys(camera.source for camera in found.values()))
    offsets = {id: camera.offset.offset_s for id, camera in found.items()}
    if not rig.is_dir():
        typer.echo("lines for the [[viewer]] tables of the rig file:")
        for id, offset_s in offsets.items():
            typer.echo(f"offset_s = {offset_s + 0.0:.4f}  # viewer {id}")
    elif given.dry_run:
        typer.echo(sync_text(offsets, f"from {sources}; not written").rstrip())
    else:
        names = camera_names(rig)
        comment = f"Written by zenocap sync, from {sources}; seconds after the first camera's video began"
        by_name = {names[id]: value for id, value in offsets.items()}
        by_name = by_name if given.cameras is None else with_others(rig, by_name, list(names.values()))
        typer.echo(f"written: {write_sync(rig, by_name, comment)}")


def _sync_take(path: Path) -> None:
    """Print the delays of a take's cameras, and exit.  Raises UserError."""
    from zenocap.tools.setup.sync import take

    found = take.take_delays(path)
    for line in take.lines_of(found):
        typer.echo(line)
    if found.uncertain:
        advice = "what helps: a person who walks through the whole area in the first 20 s, seen whole by all cameras"
        typer.echo(f"not certain: {', '.join(found.uncertain)}: {advice}", err=True)
        raise typer.Exit(LOSS)
    typer.echo("to add to delay_ms in the [[viewer]] tables of the rig file, which had 0 where there is none:")
    for line in take.rig_lines(found):
        typer.echo(line)
    raise typer.Exit(DONE)


def line_of(rig: Rig, id: str, camera: CameraOffset) -> str:
    """One line for a camera: offset in seconds and frames, its error, what it was found from, and whether it is certain."""
    found, period_s = camera.offset, 1.0 / rig.viewer(id).fps
    if not camera.is_certain:
        best = f"; the best is {found.offset_s:+.3f} s" if found.offset_s and isfinite(found.offset_s) else ""
        return f"{id}: not certain, by {camera.source}: {found.reason}{best}"
    unit = UNITS[camera.source]
    return (
        f"{id}: {found.offset_s + 0.0:+.4f} s, {found.offset_s / period_s + 0.0:+.2f} frames "
        f"(± {found.error_s / period_s:.2f}), by {camera.source}: {found.residual:.2f} {unit}, "
        f"margin {found.margin:.0f}, {found.pairs} pair{'s' if found.pairs != 1 else ''}"
    )


def with_others(folder: Path, found: Mapping[str, float], names: Sequence[str]) -> dict[str, float]:
    """Offsets by camera, those of an existing sync.toml for the cameras that were not compared; both from the same moment.

    found: from the first of the compared cameras on.  names: of all cameras.  Raises UserError.
    """
    from zenocap.common.rig.folder import SYNC_FILE, read_offsets

    kept = read_offsets(folder / SYNC_FILE, names)
    begin_s = kept.get(next(iter(found)), 0.0)
    compared = {name: begin_s + offset_s for name, offset_s in found.items()}
    every = {**kept, **compared}
    return {name: every[name] for name in names if name in every}


def camera_names(folder: Path) -> dict[str, str]:
    """Names of the cameras in the folder's calibration, by viewer."""
    from zenocap.common.camera.calibration_files import read_calibration
    from zenocap.common.rig.folder import plain_name

    return {plain_name(name): name for name in read_calibration(folder / "calibration.toml", placed=False)}
