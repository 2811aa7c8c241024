"""Commands that learn and show motion priors: prior train, prior info."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from msgspec import to_builtins

from zenocap.tools.cli.options import JointsOption, JsonOption, OutputOption, one_line_errors
from zenocap.tools.cli.progress import progress

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.body.anatomy import Anatomy
    from zenocap.common.formats.joint_map import JointMap
    from zenocap.services.tracker.prior.model import Prior
    from zenocap.services.tracker.prior.sequences import TrainingMotion

NAMES_SHOWN = 6

prior = typer.Typer(help="Motion priors, trained on motion capture or takes.", no_args_is_help=True)


@prior.command()
def train(
    motions: Annotated[
        list[Path],
        typer.Argument(metavar="MOTION...", help="Training files: .bvh, .trc, .c3d, or takes (.mcap).", show_default=False),
    ],
    output: OutputOption,
    held: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Validation motion, by which the number of regions is chosen; may be repeated.",
            show_default=False,
        ),
    ] = None,
    regions: Annotated[
        int | None, typer.Option(min=1, max=500, metavar="M", help="Number of regions; default: chosen, 5 to 80.")
    ] = None,
    dims: Annotated[int, typer.Option(min=1, max=10, help="Dimensions of each region's subspace.")] = 3,
    anatomy: Annotated[
        Literal["fourteen-parts", "ten-parts"], typer.Option(help="Body model that will be tracked.")
    ] = "fourteen-parts",
    rate: Annotated[float, typer.Option(min=1, max=1000, help="Frames per second that motions are resampled to.")] = 60.0,
    frames: Annotated[
        str | None, typer.Option(metavar="FIRST-LAST", help="Only these frames of every MOTION, such as 0-99.")
    ] = None,
    mirror: Annotated[bool, typer.Option(help="Add a copy of every motion with left and right exchanged.")] = True,
    seed: Annotated[int, typer.Option(min=0, help="Random seed; equal seeds give identical output.")] = 0,
    plot: Annotated[
        Path | None, typer.Option(metavar="FIG", help="Plot the reconstruction errors (.png, .svg, .pdf).")
    ] = None,
    joints: JointsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Train a motion prior: regions of similar poses, a subspace for each, and transition probabilities.

    Prints the reconstruction error by number of regions, on training and on validation motion, and chooses the smallest
    number within 5 % of the best on validation motion. Without --held, every fifth second is held out for validation and
    then added to the training set. An existing output is replaced.

    Example: `zenocap prior train walk1.bvh walk2.bvh --held walk3.bvh -o walk.prior --plot errors.png`
    """
    wanted = None if frames is None else parsed_frames(frames)
    with one_line_errors():
        from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS
        from zenocap.common.body.coordinates import coordinates_of
        from zenocap.common.errors import UserError
        from zenocap.common.formats.file_warnings import grouped_warnings
        from zenocap.common.formats.joint_map import read_joint_map
        from zenocap.services.tracker.prior.file import write_prior
        from zenocap.services.tracker.prior.training import TrainingPlan
        from zenocap.services.tracker.prior.training import train as run_train

        for path in (output, *([] if plot is None else [plot])):
            if not path.parent.is_dir():
                raise UserError(f"{path}: there is no folder {path.parent}: allowed: a file in a folder that exists")
        draw = None if plot is None else _drawing(plot)
        body = {"fourteen-parts": FOURTEEN_PARTS, "ten-parts": TEN_PARTS}[anatomy]
        names = None if joints is None else read_joint_map(joints)
        plan = TrainingPlan(dims, rate, mirror, seed, regions)
        with progress("learning", "steps") as state:
            with grouped_warnings():
                learnt_from = [_recording(path, body, wanted, names) for path in motions]
                held_out = [_recording(path, body, None, names) for path in held or ()]
            found = run_train(coordinates_of(body), learnt_from, held_out, plan, state.update)
        write_prior(output, found)
        if draw is not None:
            draw(found)
    _show(output, found, as_json)


@prior.command()
def info(
    file: Annotated[
        str, typer.Argument(metavar="PRIOR", help="A file, or the name of a shipped prior.", show_default=False)
    ],
    as_json: JsonOption = False,
) -> None:
    """Show the training data of a prior, its reconstruction error, and its content.

    Angles are in radians with --json, otherwise in degrees. Names of the shipped priors: walking, running, boxing,
    general.

    Example: `zenocap prior info walking`
    """
    with one_line_errors():
        from zenocap.common.rig.tracker import find_prior
        from zenocap.services.tracker.prior.file import read_prior

        path = find_prior(file)
        found = read_prior(path)
    _show(path, found, as_json)


def parsed_frames(text: str) -> range:
    """The frames of "0-99", the last included.  Raises typer.BadParameter."""
    numbers = re.fullmatch(r"(\d{1,9})-(\d{1,9})", text)
    if not numbers or int(numbers[2]) <= int(numbers[1]):
        raise typer.BadParameter(f"--frames {text!r}: allowed: two frame numbers, rising, such as 0-99")
    return range(int(numbers[1]), int(numbers[2]) + 1)


def lines_of(path: Path, prior: Prior) -> Iterator[str]:
    """Description of a prior as text lines."""
    training = prior.training
    mirrored = ", half of them mirrored" if training.mirrored else ""
    yield f"prior       {path}: {path.stat().st_size / 1000:.0f} kB"
    yield f"body        {prior.anatomy}, {len(prior.names)} coordinates"
    frames = f"{training.frames} frames at {prior.rate:g}/s{mirrored}"
    yield f"trained on  {_names(training.motions)}: {frames}, seed {training.seed}"
    yield f"held out    {_names(training.held) if training.held else 'every fifth stretch'}"
    yield f"regions     {prior.regions} of {prior.dimensions} dimensions"
    within = ", ".join(f"{degrees(value):.2f}" for value in training.distances)
    yield f"distances   of 100 held-out poses 50, 90 and 99 are within {within}°"
    yield ""
    yield "reconstruction error, root mean square over frames and coordinates"
    yield f"{'regions':>8} {'training':>9} {'held out':>9}"
    for row in training.errors:
        yield f"{row.regions:8d} {degrees(row.training):8.2f}° {degrees(row.held):8.2f}°"


def _names(names: tuple[str, ...]) -> str:
    more = len(names) - NAMES_SHOWN
    return ", ".join(names[:NAMES_SHOWN]) + (f" and {more} more" if more > 0 else "")


def _show(path: Path, prior: Prior, as_json: bool) -> None:
    if not as_json:
        for line in lines_of(path, prior):
            typer.echo(line)
        return
    content = {
        "file": str(path),
        "anatomy": prior.anatomy,
        "rate": prior.rate,
        "regions": prior.regions,
        "dimensions": prior.dimensions,
        "speeds": dict(zip(prior.names, prior.speeds.tolist(), strict=True)),
        "training": to_builtins(prior.training),
    }
    typer.echo(json.dumps(content))


def _recording(path: Path, anatomy: Anatomy, frames: range | None, joints: JointMap | None) -> TrainingMotion:
    """Raises UserError."""
    from zenocap.common.errors import UserError
    from zenocap.services.tracker.prior.motions import read_motion

    if not path.is_file():
        raise UserError(f"{path}: there is no such file: allowed: a .bvh, .trc, .c3d or .mcap")
    return read_motion(path, anatomy, frames, joints)


def _drawing(path: Path) -> Callable[[Prior], None]:
    """Raises UserError where drawing is not installed or the file's kind not known."""
    from zenocap.common.errors import UserError

    kinds = (".png", ".svg", ".pdf")
    if path.suffix not in kinds:
        raise UserError(f"--plot {path}: suffix {path.suffix!r}: allowed: {', '.join(kinds)}")
    try:
        from zenocap.services.tracker.prior.training import draw_errors
    except ImportError:
        raise UserError("--plot needs matplotlib: pip install 'zenocap[plots]'") from None
    return lambda prior: draw_errors(path, prior)
