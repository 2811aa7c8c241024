"""Commands that learn and show motion priors: prior train, prior info."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from msgspec import to_builtins

from zenocap.common.errors import UserError
from zenocap.tools.cli.options import JointsOption, JsonOption, OutputOption, check_folder, check_plot, one_line_errors
from zenocap.tools.cli.progress import progress
from zenocap.tools.option_groups import RESEARCH, add_command, option

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.body.anatomy import Anatomy
    from zenocap.common.formats.joint_map import JointMap
    from zenocap.services.tracker.prior.model import Prior
    from zenocap.services.tracker.prior.sequences import TrainingMotion

NAMES_SHOWN = 6

prior = typer.Typer(help="Motion priors, trained on motion capture or takes.", no_args_is_help=True)

Motions = Annotated[
    list[Path], typer.Argument(metavar="MOTION...", help="Training files: .bvh, .trc, .c3d, or takes (.mcap).")
]


@dataclass(frozen=True)
class PriorArguments:
    """held: motion for validation.  frames: in words."""

    held: list[Path] | None = option(
        None, "Validation motion, for the choice of the number of regions; may be repeated.", metavar="FILE"
    )
    frames: str | None = option(None, "Only these frames of every MOTION, such as 0-99.", metavar="FIRST-LAST")
    mirror: bool = option(True, "Add a copy of every motion with left and right exchanged.")
    plot: Path | None = option(None, "Plot the reconstruction errors (.png, .jpg, .pdf, .svg).", metavar="FIG")
    joints: JointsOption = None
    as_json: JsonOption = False


@dataclass(frozen=True)
class PriorResearch:
    """Size of the prior, and how it is learnt."""

    regions: int | None = option(None, "Number of regions; default: chosen, 5 to 80.", min=1, max=500, metavar="M")
    dims: int = option(3, "Dimensions of each region's subspace.", min=1, max=10)
    anatomy: Literal["fourteen-parts", "ten-parts"] = option("fourteen-parts", "Body model that will be tracked.")
    rate: float = option(60.0, "Frames per second that motions are resampled to.", min=1, max=1000)
    seed: int = option(0, "Random seed; equal seeds give identical output.", min=0)


def train(
    motions: Motions, output: OutputOption, *, given: PriorArguments, research: Annotated[PriorResearch, RESEARCH]
) -> None:
    """Train a motion prior: regions of similar poses, a subspace for each, and transition probabilities.

    Prints the reconstruction error by number of regions, on training and on validation motion, and chooses the smallest
    number within 5 % of the best on validation motion. Without --held, every fifth second is held out for validation and
    then added to the training set. An existing output is replaced.

    Example: `zenocap prior train walk1.bvh walk2.bvh --held walk3.bvh -o walk.prior --plot errors.png`
    """
    wanted = None if given.frames is None else parsed_frames(given.frames)
    with one_line_errors():
        from zenocap.common.body.anatomy import FOURTEEN_PARTS, TEN_PARTS
        from zenocap.common.body.coordinates import coordinates_of
        from zenocap.common.formats.file_warnings import grouped_warnings
        from zenocap.common.formats.joint_map import read_joint_map
        from zenocap.services.tracker.prior.file import write_prior
        from zenocap.services.tracker.prior.training import TrainingPlan, draw_errors
        from zenocap.services.tracker.prior.training import train as run_train

        check_folder(output)
        check_plot(given.plot)
        body = {"fourteen-parts": FOURTEEN_PARTS, "ten-parts": TEN_PARTS}[research.anatomy]
        names = None if given.joints is None else read_joint_map(given.joints)
        plan = TrainingPlan(research.dims, research.rate, given.mirror, research.seed, research.regions)
        with progress("learning", "steps") as state:
            with grouped_warnings():
                learnt_from = [_recording(path, body, wanted, names) for path in motions]
                held_out = [_recording(path, body, None, names) for path in given.held or ()]
            found = run_train(coordinates_of(body), learnt_from, held_out, plan, state.update)
        write_prior(output, found)
        if given.plot is not None:
            draw_errors(given.plot, found)
    _show(output, found, given.as_json)


def info(
    file: Annotated[str, typer.Argument(metavar="PRIOR", help="A file, or the name of a shipped prior.")],
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
        "file": str(path), "anatomy": prior.anatomy, "rate": prior.rate, "regions": prior.regions,
        "dimensions": prior.dimensions, "speeds": dict(zip(prior.names, prior.speeds.tolist(), strict=True)),
        "training": to_builtins(prior.training),
    }  # fmt: skip
    typer.echo(json.dumps(content))


def _recording(path: Path, anatomy: Anatomy, frames: range | None, joints: JointMap | None) -> TrainingMotion:
    """Raises UserError."""
    from zenocap.services.tracker.prior.motions import read_motion

    if not path.is_file():
        raise UserError(f"{path}: there is no such file: allowed: a .bvh, .trc, .c3d or .mcap")
    return read_motion(path, anatomy, frames, joints)


for command in (train, info):
    add_command(prior, command)
