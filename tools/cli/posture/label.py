"""The command that helps a person to make a manifest: posture label."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.tools.cli.live_page import DEFAULT_PORT, page_table
from zenocap.tools.cli.options import JointsOption, JsonOption, one_line_errors
from zenocap.tools.cli.posture.label_terminal import label_in_terminal
from zenocap.tools.cli.posture.training_options import HOW

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.rig.animator import PageTable
    from zenocap.services.recognizer.ignored_parts import Part
    from zenocap.services.recognizer.model import PostureModel
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
    rig: Annotated[
        Path | None,
        typer.Option(
            "--rig",
            metavar="RIG",
            help="Rig file of a running rig, whose poses the page can recognize live with the trained model.",
            show_default=False,
            rich_help_panel=PAGE,
        ),
    ] = None,
    false_per_hour: Annotated[
        float | None,
        typer.Option(
            metavar="N",
            help="Train raises the thresholds until the background shows at most N false postures per hour; default: that "
            "of the model's last training, else no limit.",
            show_default=False,
            rich_help_panel=HOW,
        ),
    ] = None,
    ignore: Annotated[
        str | None,
        typer.Option(
            metavar="PART,...",
            help="Parts of the body that Train does not use: arms, legs, head, or '' for none; default: those of the "
            "model's last training, else none.",
            show_default=False,
            rich_help_panel=HOW,
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
    machine can open the page, unless --host is given. Without --ignore and --false-per-hour, an existing model is trained
    again with its own, which FILE.examples keeps beside it.

    With --rig, *Try live* shows what the trained model recognizes in the poses of a running rig. The rig's own recognizer
    and its commands are not touched; a rig with certificates needs those of a reader.

    --terminal works without a page: every segment is played and its label is asked for; labelled segments are skipped, so
    the work can be interrupted. --list, --json and --accept need no page either.

    Example: `zenocap posture label monday.mcap -o lessons --person anna`
    """
    with one_line_errors():
        from zenocap.services.recognizer.ignored_parts import parts_of

        if terminal or accept or only_list or as_json:
            if len(sources) > 1:
                raise typer.BadParameter(f"{len(sources)} takes: allowed with --terminal, --list, --accept and --json: one")
            if ignore is not None or false_per_hour is not None:
                name = "--ignore" if ignore is not None else "--false-per-hour"
                raise typer.BadParameter(f"{name}: allowed without --terminal, --list, --accept and --json")
            if rig is not None:
                raise typer.BadParameter("--rig: allowed without --terminal, --list, --accept and --json")
            guesser = _suggesting(model)
            label_in_terminal(
                sources[0], output, guesser, person, accept, only_list or as_json, play, speed, as_json, joints
            )
        else:
            table, parts = page_table(host, port, token), None if ignore is None else parts_of(ignore)
            _on_page(sources, output or Path(), _suggesting(model), person, table, joints, false_per_hour, parts, rig)


def _on_page(
    sources: Sequence[Path],
    output: Path,
    suggesting: tuple[str, PostureModel] | None,
    person: str,
    table: PageTable,
    joints: Path | None,
    false_per_hour: float | None,
    ignored: tuple[Part, ...] | None,
    rig_path: Path | None,
) -> None:
    """Raises UserError."""
    from zenocap.common.errors import UserError
    from zenocap.common.formats.file_warnings import grouped_warnings
    from zenocap.common.formats.joint_map import read_joint_map
    from zenocap.common.rig.rig import load_rig
    from zenocap.common.runtime import logs
    from zenocap.common.runtime.signals import stop_signals
    from zenocap.services.recognizer.training.example_files import examples_of
    from zenocap.services.recognizer.training.examples import Example
    from zenocap.tools.cli.posture.tracked_sources import TRACKED, Report, with_takes
    from zenocap.tools.cli.zenoh_arguments import ZenohArguments
    from zenocap.tools.posture_page.labels import checked_text
    from zenocap.tools.posture_page.live_trial import live_trial
    from zenocap.tools.posture_page.manifest_file import ManifestFile, manifest_at
    from zenocap.tools.posture_page.motion_view import open_motion
    from zenocap.tools.posture_page.page import PosturePage, run_page
    from zenocap.tools.posture_page.session import Publish, TeachingSession
    from zenocap.tools.posture_page.training_settings import settings_for

    logs.configure("postures")
    if len({source.resolve() for source in sources}) < len(sources):
        raise UserError("a take is given twice: allowed: every take once")
    person = checked_text("--person", person)
    file = ManifestFile(manifest_at(output))
    file.check_writable()
    settings = settings_for(file.model, false_per_hour, ignored)
    rig = None if rig_path is None else load_rig(rig_path, files=False)
    reached = None if rig is None else ZenohArguments().options(rig)
    names = None if joints is None else read_joint_map(joints)
    with grouped_warnings():
        takes = [open_motion(source, names) for source in sources]

    def read(rows: Sequence[Row], report: Report) -> list[Example]:
        tracked = with_takes(file.path, rows, file.path.parent / TRACKED, None, report)
        return examples_of(file.path, tracked, settings.training.features, report, joints=names)

    def session(publish: Publish) -> TeachingSession:
        live = None
        if rig is not None and reached is not None:
            live = live_trial(rig, reached, lambda update: publish("live", update))
        return TeachingSession(takes, file, person, read, publish, suggesting=suggesting, settings=settings, live=live)

    page = PosturePage(takes, session, table)
    with stop_signals() as stopped:
        run_page(page, stopped, lambda url: typer.echo(f"{file.path}: open {url} in a browser; Ctrl-C ends"))


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
