"""The command that helps a person to make a manifest: posture label."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.common.errors import UserError
from zenocap.tools.cli.live_page import page_table
from zenocap.tools.cli.options import one_line_errors, refuse
from zenocap.tools.cli.posture.label_options import SHIPPED, LabelArguments, LabelExpert, Sources
from zenocap.tools.cli.posture.label_terminal import label_in_terminal
from zenocap.tools.option_groups import EXPERT
from zenocap.tools.service_arguments import ZenohArguments

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.formats.joint_map import JointMap
    from zenocap.common.rig.rig import Rig
    from zenocap.services.recognizer.model import PostureModel
    from zenocap.services.recognizer.training.examples import Example
    from zenocap.services.recognizer.training.manifest import ManifestRow
    from zenocap.tools.cli.posture.tracked_sources import Report
    from zenocap.tools.teach.page.manifest_file import ManifestFile
    from zenocap.tools.teach.page.motion_view import MotionView
    from zenocap.tools.teach.page.session import Publish, TeachingSession
    from zenocap.tools.teach.page.training_settings import PageSettings


def label(sources: Sources, *, given: LabelArguments, expert: Annotated[LabelExpert, EXPERT]) -> None:
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
        if given.has_page:
            _on_page(sources, given, expert)
            return
        wrong = {
            f"{len(sources)} takes: allowed with --terminal, --list, --accept and --json: one": len(sources) > 1,
            "--ignore: allowed without --terminal, --list, --accept and --json": expert.ignore is not None,
            "--false-per-hour: allowed without --terminal, --list, --accept and --json": expert.false_per_hour is not None,
            "--rig: allowed without --terminal, --list, --accept and --json": given.rig is not None,
        }
        refuse(wrong)
        label_in_terminal(sources[0], _suggesting(given.model), given, expert)


def _on_page(sources: Sequence[Path], given: LabelArguments, expert: LabelExpert) -> None:
    """Raises UserError."""
    from zenocap.common.formats.file_warnings import grouped_warnings
    from zenocap.common.formats.joint_map import read_joint_map
    from zenocap.common.rig.rig import load_rig
    from zenocap.common.runtime import logs
    from zenocap.common.runtime.signals import stop_signals
    from zenocap.services.recognizer.ignored_parts import parts_of
    from zenocap.tools.teach.page.labels import checked_text
    from zenocap.tools.teach.page.manifest_file import ManifestFile, manifest_at
    from zenocap.tools.teach.page.motion_view import open_motion
    from zenocap.tools.teach.page.page import PosturePage, run_page
    from zenocap.tools.teach.page.training_settings import settings_for

    table = page_table(expert.host, expert.port, expert.token)
    parts = None if expert.ignore is None else parts_of(expert.ignore)
    suggesting = _suggesting(given.model)
    logs.configure("postures")
    if len({source.resolve() for source in sources}) < len(sources):
        raise UserError("a take is given twice: allowed: every take once")
    person = checked_text("--person", given.person)
    file = ManifestFile(manifest_at(given.output or Path()))
    file.check_writable()
    settings = settings_for(file.model, expert.false_per_hour, parts)
    rig = None if given.rig is None else load_rig(given.rig, files=False)
    names = None if given.joints is None else read_joint_map(given.joints)
    with grouped_warnings():
        takes = [open_motion(source, names) for source in sources]
    page = PosturePage(takes, _session(takes, file, settings, names, suggesting, person, rig), table)
    with stop_signals() as stopped:
        run_page(page, stopped, lambda url: typer.echo(f"{file.path}: open {url} in a browser; Ctrl-C ends"))


def _session(
    takes: Sequence[MotionView], file: ManifestFile, settings: PageSettings, names: JointMap | None,
    suggesting: tuple[str, PostureModel] | None, person: str, rig: Rig | None,
) -> Callable[[Publish], TeachingSession]:  # fmt: skip
    """Function that makes the session of the page.  Raises UserError."""
    from zenocap.services.recognizer.training.example_files import examples_of
    from zenocap.tools.cli.posture.tracked_sources import TRACKED, with_takes
    from zenocap.tools.teach.page.live_trial import live_trial
    from zenocap.tools.teach.page.session import TeachingSession

    reached = None if rig is None else ZenohArguments().options(rig)

    def read(rows: Sequence[ManifestRow], report: Report) -> list[Example]:
        tracked = with_takes(file.path, rows, file.path.parent / TRACKED, None, report)
        return examples_of(file.path, tracked, settings.training.features, report, joints=names)

    def session(publish: Publish) -> TeachingSession:
        live = None
        if rig is not None and reached is not None:
            live = live_trial(rig, reached, lambda update: publish("live", update))
        return TeachingSession(takes, file, person, read, publish, suggesting=suggesting, settings=settings, live=live)

    return session


def _suggesting(name: str | None) -> tuple[str, PostureModel] | None:
    """Name and model that suggests labels.  Raises UserError for a model that was asked for."""
    from zenocap.services.recognizer.model_file import find_model, read_model

    try:
        return name or SHIPPED, read_model(find_model(name or SHIPPED))
    except UserError:
        if name is not None:
            raise
        return None
