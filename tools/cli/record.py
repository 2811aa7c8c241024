"""The command that records the messages of a rig: record."""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.tools.cli.options import one_line_errors, take_folder
from zenocap.tools.cli.suggestions import check_rig_path
from zenocap.tools.option_groups import EXPERT, option
from zenocap.tools.service_arguments import ZenohArguments

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.recording.parts import PartLimits
    from zenocap.common.rig.file import LogTable
    from zenocap.tools.record.recorder import RecordingProgress, RecordingSelection

PLAIN_S = 10  # seconds from line to line where there is no terminal

What = Annotated[
    str,
    typer.Argument(
        metavar="RIG", help="Rig file or folder, name of a rig, or key expression such as 'zenocap/studio/viewer/**'."
    ),
]


@dataclass(frozen=True)
class RecordArguments:
    """seconds: None until Ctrl-C."""

    output: Path | None = option(
        None, "Take to write (NAME.mcap), or a folder; default: a new name of rig and time.", "-o", "--output",
        metavar="FILE|DIR",
    )  # fmt: skip
    seconds: float | None = option(None, "Recording time (s); default: until Ctrl-C.", min=0.1)
    topics: list[str] | None = option(
        None, "Topic to record, such as universal_bap; default: all; may be repeated.", metavar="NAME"
    )
    id: str | None = option(None, "Id of this recorder; default: this machine's name.")


@dataclass(frozen=True)
class PartArguments:
    """Sizes at which a new file begins."""

    part_mb: float | None = option(
        None, "Size at which a new file begins (MB); 0 for never; default: the rig's own.", min=0
    )
    part_minutes: float | None = option(
        None, "Time after which a new file begins (min); 0 for never; default: the rig's own.", min=0
    )

    def limits(self, table: LogTable) -> PartLimits:
        """table: the rig's own."""
        from zenocap.common.recording.parts import PartLimits

        return PartLimits.of(
            table.part_mb if self.part_mb is None else self.part_mb,
            table.part_minutes if self.part_minutes is None else self.part_minutes,
        )


def record(what: What, *, given: RecordArguments, parts: Annotated[PartArguments, EXPERT], zenoh: ZenohArguments) -> None:
    """Record the messages of a rig from any machine on its network.

    Its take is in addition to the integrator's, or instead of it. A rig file provides the rig's name, its Zenoh options
    and the files that are attached to the take; a name or a key expression works without it. Every message is
    validated. Several recorders may run, each with its own id. It ends with Ctrl-C. Exit status: 3 when messages were
    lost, 1 when none arrived.

    Example: `zenocap record studio --seconds 600 --part-minutes 10 -e tcp/192.168.1.10:7447`
    """
    from zenocap.common.rig.file import LogTable
    from zenocap.common.runtime import logs
    from zenocap.common.runtime.signals import stop_signals
    from zenocap.tools.record.recorder import own_id, parse_selection, run_recorder, topics_named

    logs.configure("recorder")
    with one_line_errors(), stop_signals() as stopped:
        if Path(what).suffix in (".mcap", ".toml") or Path(what).is_dir():
            check_rig_path(Path(what))
        selection = parse_selection(what)
        own = own_id() if given.id is None else _checked_id(given.id)
        limits = parts.limits(selection.file.log if selection.file else LogTable())
        take = _take(selection, what, given.output)
        options = zenoh.options(selection.file, "recorder")
        end_s = inf if given.seconds is None else time.monotonic() + given.seconds
        status = run_recorder(
            selection, options, take, own, topics_named(given.topics or ()), limits,
            lambda: stopped() or time.monotonic() >= end_s, _Line(str(take)).show,
        )  # fmt: skip
    raise typer.Exit(status)


def _checked_id(text: str) -> str:
    """Raises typer.BadParameter."""
    from zenocap.common.topics import checked_name

    try:
        checked_name("--id", text)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None
    return text


def _take(selection: RecordingSelection, what: str, output: Path | None) -> Path:
    """Path of the take: `output`, or a new name in that folder, else in the rig's."""
    from zenocap.common.recording.parts import take_path
    from zenocap.common.rig.file import LogTable

    if output is not None and output.suffix == ".mcap":
        return output
    own = take_folder(selection.file, Path(what), None) if selection.file else Path(LogTable().folder)
    return take_path(selection.name, output or own, time.time_ns())


class _Line:
    """Status line: overwritten on a terminal, elsewhere one every PLAIN_S seconds."""

    def __init__(self, take: str) -> None:
        self._take = take
        self._seconds = 0

    def show(self, progress: RecordingProgress) -> None:
        parts = f", {progress.parts} files" if progress.parts > 1 else ""
        free = f", {progress.free_bytes / 1e9:.1f} GB free" if progress.free_bytes is not None else ""
        text = (
            f"{self._seconds:5d} s  {progress.messages} messages, {progress.bytes / 1e6:.1f} MB, "
            f"{progress.lost} lost{parts}{free}  {self._take}"
        )
        if sys.stderr.isatty():
            typer.echo(f"\r{text}\x1b[K", err=True, nl=False)
        elif self._seconds % PLAIN_S == 0:
            typer.echo(text, err=True)
        self._seconds += 1
