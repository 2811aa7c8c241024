"""The command that helps a person to make a manifest: posture label."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.tools.cli.live_page import DEFAULT_PORT, page_table
from zenocap.tools.cli.options import JointsOption, JsonOption, one_line_errors
from zenocap.tools.cli.posture.label_terminal import labels_entered

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.rig.animator import PageTable
    from zenocap.services.recognizer.model import PostureModel
    from zenocap.services.recognizer.training.labelling import Candidate, Suggestion
    from zenocap.services.recognizer.training.manifest import Row

SHIPPED = "fifteen"
PAGE, TERMINAL = "Page", "Terminal"


def label(
    sources: Annotated[
        list[Path],
        typer.Argument(metavar="TAKE...", help="Takes (.mcap), or motion capture (.bvh, .trc, .c3d).", show_default=False),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FOLDER|MANIFEST",
            help="Folder of examples.csv, or a manifest; existing rows are kept. Default: this folder.",
            show_default=False,
        ),
    ] = None,
    model: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE", help=f"Posture model that suggests labels; default: {SHIPPED}, which is built in."
        ),
    ] = None,
    person: Annotated[str, typer.Option(metavar="NAME", help="Person in the takes.")] = "1",
    host: Annotated[
        str, typer.Option("--host", help="Address of the page on this machine.", rich_help_panel=PAGE)
    ] = "127.0.0.1",
    port: Annotated[
        int | None,
        typer.Option(
            "--port",
            min=0,
            max=65535,
            help=f"Port of the page, 0 for any free one; default: {DEFAULT_PORT} or a free one.",
            rich_help_panel=PAGE,
        ),
    ] = None,
    token: Annotated[
        str | None,
        typer.Option(
            "--token",
            help="Access token; required with a --host that other machines can reach. `new` generates one.",
            show_default=False,
            rich_help_panel=PAGE,
        ),
    ] = None,
    terminal: Annotated[
        bool,
        typer.Option("--terminal", help="No page: play and label here; without -o only list.", rich_help_panel=TERMINAL),
    ] = False,
    accept: Annotated[
        bool,
        typer.Option(
            "--accept", help="Do not ask: accept all suggestions above the model's thresholds.", rich_help_panel=TERMINAL
        ),
    ] = False,
    only_list: Annotated[bool, typer.Option("--list", help="List the candidates only.", rich_help_panel=TERMINAL)] = False,
    play: Annotated[bool, typer.Option(help="Play every candidate in the terminal.", rich_help_panel=TERMINAL)] = True,
    speed: Annotated[
        float, typer.Option(min=0.05, max=20, help="Playback speed of candidates.", rich_help_panel=TERMINAL)
    ] = 1.0,
    joints: JointsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Label postures in takes on a page, train a model of them and try it, until Ctrl-C.

    The page plays the takes and proposes movements between two moments of rest. Every change is saved at once to the
    manifest, which `zenocap posture train` reads, too; the model is written beside it, with the suffix .postures. Only this
    machine can open the page, unless --host is given.

    --terminal works without a page: every segment is played and its label is asked for; labelled segments are skipped, so
    the work can be interrupted. --list, --json and --accept need no page either.

    Example: `zenocap posture label monday.mcap -o lessons --person anna`
    """
    with one_line_errors():
        if terminal or accept or only_list or as_json:
            if len(sources) > 1:
                raise typer.BadParameter(f"{len(sources)} takes: allowed with --terminal, --list, --accept and --json: one")
            _in_terminal(sources[0], output, model, person, accept, only_list or as_json, play, speed, as_json, joints)
        else:
            _on_page(sources, output or Path(), _suggesting(model), person, page_table(host, port, token), joints)


def _on_page(
    sources: Sequence[Path],
    output: Path,
    suggesting: tuple[str, PostureModel] | None,
    person: str,
    table: PageTable,
    joints: Path | None,
) -> None:
    """Raises UserError."""
    from zenocap.common.errors import UserError
    from zenocap.common.formats.joint_map import read_joint_map
    from zenocap.common.runtime import logs
    from zenocap.common.runtime.signals import stop_signals
    from zenocap.services.recognizer.training.example_files import examples_of
    from zenocap.services.recognizer.training.examples import Example
    from zenocap.tools.cli.posture.tracked_sources import TRACKED, Report, with_takes
    from zenocap.tools.posture_page.labels import checked_text
    from zenocap.tools.posture_page.manifest_file import ManifestFile, manifest_at
    from zenocap.tools.posture_page.motion_view import open_motion
    from zenocap.tools.posture_page.page import PosturePage, run_page
    from zenocap.tools.posture_page.session import Session

    logs.configure("postures")
    if len({source.resolve() for source in sources}) < len(sources):
        raise UserError("a take is given twice: allowed: every take once")
    person = checked_text("--person", person)
    file = ManifestFile(manifest_at(output))
    file.check_writable()
    names = None if joints is None else read_joint_map(joints)
    takes = [open_motion(source, names) for source in sources]

    def read(rows: Sequence[Row], report: Report) -> list[Example]:
        tracked = with_takes(file.path, rows, file.path.parent / TRACKED, None, report)
        return examples_of(file.path, tracked, "directions", report, joints=names)

    page = PosturePage(takes, lambda publish: Session(takes, file, person, read, publish, suggesting=suggesting), table)
    with stop_signals() as stopped:
        run_page(page, stopped, lambda url: typer.echo(f"{file.path}: open {url} in a browser; Ctrl-C ends"))


def _in_terminal(
    source: Path,
    output: Path | None,
    model: str | None,
    person: str,
    accept: bool,
    only_list: bool,
    play: bool,
    speed: float,
    as_json: bool,
    joints: Path | None,
) -> None:
    """Raises UserError."""
    from zenocap.common.formats.joint_map import read_joint_map
    from zenocap.common.formats.motion_files import read_centres
    from zenocap.services.recognizer.training.example_files import read_features
    from zenocap.services.recognizer.training.labelling import add_rows, candidates_of, is_labelled, suggest_labels
    from zenocap.services.recognizer.training.manifest import write_manifest
    from zenocap.tools.posture_page.manifest_file import manifest_at

    output = None if output is None else manifest_at(output)
    guesser = _suggesting(model)
    names = None if joints is None else read_joint_map(joints)
    motion = read_features(source, "directions", names)
    found = candidates_of(motion.times_s, motion.features, motion.rate)
    rows = _rows_of(output)
    left = [one for one in found if not is_labelled(rows, source, one)]
    none: list[Suggestion | None] = [None] * len(left)
    guesses = dict(zip(left, suggest_labels(guesser[1], source, left) if guesser else none, strict=True))
    if output is None or only_list:
        _list(source, guesses, as_json)
        return
    if accept:
        chosen = [(one, guess.label) for one, guess in guesses.items() if guess and guess.known]
    else:
        centres = read_centres(source, names) if play else None
        chosen = labels_entered(guesses, (float(motion.times_s[0]), float(motion.times_s[-1])), centres, speed)
    named = add_rows(rows, source, person, chosen)
    if chosen:
        write_manifest(output, named)
    typer.echo(f"{output}: {len(chosen)} of {len(left)} labelled, {len(named)} rows")


def _suggesting(name: str | None) -> tuple[str, PostureModel] | None:
    """Name and model that suggests labels.  Raises UserError for a model that was asked for."""
    from zenocap.common.errors import UserError
    from zenocap.services.recognizer.model_file import find_model, read_model

    try:
        return name or SHIPPED, read_model(find_model(name or SHIPPED))
    except UserError:
        if name is not None:
            raise
        return None


def _list(source: Path, guesses: Mapping[Candidate, Suggestion | None], as_json: bool) -> None:
    if as_json:
        rows = [asdict(one) | {"guess": asdict(guess) if guess else None} for one, guess in guesses.items()]
        typer.echo(json.dumps({"source": str(source), "candidates": rows}, ensure_ascii=False))
        return
    if not guesses:
        typer.echo(f"{source}: no movement is long enough, or all segments are labelled")
        return
    typer.echo(f"{'':>3} {'start s':>8} {'end s':>8} {'seconds':>8}  {'suggestion':24} moving limbs")
    for number, (one, guess) in enumerate(guesses.items(), 1):
        typer.echo(
            f"{number:3d} {one.start_s:8.2f} {one.end_s:8.2f} {one.end_s - one.start_s:8.2f}  {guess or '-'!s:24} "
            f"{', '.join(one.limbs)}"
        )
    typer.echo("a suggestion with ?: the likeliest posture, but below the model's threshold")


def _rows_of(output: Path | None) -> list[Row]:
    """Raises UserError."""
    from zenocap.common.errors import UserError
    from zenocap.services.recognizer.training.manifest import read_manifest

    if output is None or not output.is_file():
        if output is not None and not output.parent.is_dir():
            raise UserError(f"{output}: there is no folder {output.parent}: allowed: a file in a folder that exists")
        return []
    return read_manifest(output)
