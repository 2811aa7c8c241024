"""The command that records from the network."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from services.commands.options import (
    ConfigOption,
    ConnectOption,
    ListenOption,
    ModeOption,
    NoMulticastOption,
    one_line_errors,
    take_folder,
    zenoh_options,
)

if TYPE_CHECKING:  # imported where it is used: `zenocap --help` answers at once
    from services.takes.record import Progress

PLAIN_S = 10  # seconds from line to line where there is no terminal


def record(
    what: Annotated[
        str,
        typer.Argument(
            metavar="RIG", help="A rig file or folder, a rig's name, or keys such as 'zenocap/studio/viewer/**'."
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="FILE|DIR", help="The take, NAME.mcap, or a folder; default: a name by rig and time."
        ),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option("--seconds", min=0.1, help="End after so long; default: with Ctrl-C.", show_default=False),
    ] = None,
    topics: Annotated[
        list[str] | None,
        typer.Option("--topics", metavar="NAME", help="Only these, such as universal_bap; may be repeated."),
    ] = None,
    part_mb: Annotated[
        float | None, typer.Option("--part-mb", min=0, help="Go on in a new file at so many megabytes; 0 for never.")
    ] = None,
    part_minutes: Annotated[
        float | None, typer.Option("--part-minutes", min=0, help="And after so many minutes; default: the rig's own.")
    ] = None,
    id: Annotated[
        str | None, typer.Option("--id", help="What this recorder is called; default: this machine's name.")
    ] = None,
    mode: ModeOption = None,
    connect: ConnectOption = None,
    listen: ListenOption = None,
    config: ConfigOption = None,
    no_multicast_scouting: NoMulticastOption = False,
) -> None:
    """Record a rig from any machine on its network, beside the integrator's own log or instead of it.

    A rig file gives the rig's name, its Zenoh options and the files that go into the take. A name or a key expression
    needs none. Only zenocap's own messages are recorded, each checked; several recorders may run, with an id each.
    It ends with Ctrl-C. Exit status: 3 when messages were lost, 1 when there was none.

    Example: `zenocap record studio --seconds 600 --part-minutes 10 -e tcp/192.168.1.10:7447`
    """
    import time

    from common.runtime import logs
    from common.runtime.rig_file import LogTable
    from common.runtime.signals import stop_signals
    from common.take.naming import take_path
    from common.take.parts import PartLimits
    from common.topics import checked_name
    from services.takes.record import own_id, run_recorder, topics_named, wanted

    logs.configure("recorder")
    with one_line_errors(), stop_signals() as stopped:
        asked = wanted(what)
        own = own_id() if id is None else id
        try:
            checked_name("--id", own)
        except ValueError as error:
            raise typer.BadParameter(str(error)) from None
        table = asked.file.log if asked.file else LogTable()
        limits = PartLimits.of(
            table.part_mb if part_mb is None else part_mb, table.part_minutes if part_minutes is None else part_minutes
        )
        folder = take_folder(asked.file, Path(what), None) if asked.file else Path(table.folder)
        if output is not None and output.suffix != ".mcap":
            folder, output = output, None
        take = output or take_path(asked.name, folder, time.time_ns())
        options = zenoh_options(asked.file, mode, connect, listen, config, no_multicast_scouting, "recorder")
        started_s = time.monotonic()

        def ended() -> bool:
            return stopped() or (seconds is not None and time.monotonic() - started_s >= seconds)

        status = run_recorder(asked, options, take, own, topics_named(topics or ()), limits, ended, _Line(str(take)).show)
    raise typer.Exit(status)


class _Line:
    """How it goes: a line that is written over on a terminal, elsewhere one every PLAIN_S seconds."""

    def __init__(self, take: str) -> None:
        self._take = take
        self._seconds = 0

    def show(self, progress: "Progress") -> None:
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
