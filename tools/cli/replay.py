"""The command that publishes the messages of takes again: replay."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.tools.cli.options import FrameRange, RemoteOption, checked_take, one_line_errors
from zenocap.tools.option_groups import EXPERT, option
from zenocap.tools.service_arguments import PANEL, ZenohArguments

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.bus.zenoh_session import ZenohOptions
    from zenocap.tools.record.replay.shell import ReplayOptions

EXPRESSION = "a key expression such as 'viewer/**' or 'zenocap/*/integrator/bap'"
Takes = Annotated[list[Path], typer.Argument(metavar="TAKE...", help="Takes (MCAP files), played one after another.")]


@dataclass(frozen=True)
class ReplayArguments:
    """How the takes are played, and which of their messages."""

    rate: float = option(
        1.0, "Speed relative to the recording; 0: as fast as the live services of the rig keep up.", "-r", "--rate", min=0,
        max=1000,
    )  # fmt: skip
    loop: bool = option(False, "Repeat without end; times and frame numbers keep rising.")
    topics: list[str] | None = option(None, f"Keys to publish: {EXPRESSION}; may be repeated.", metavar="EXPR")
    exclude: list[str] | None = option(None, "Keys to leave out; may be repeated.", "-x", "--exclude", metavar="EXPR")
    rig: str | None = option(None, "Publish as the rig of this name.", metavar="NAME")
    pause: bool = option(False, "Start paused; space continues.")
    now: bool = option(
        False, "Move times to the present: for live services that have received later times, and to show latency."
    )


@dataclass(frozen=True)
class ReplayExpert:
    """remap: other keys.  delay: before the start, s."""

    remap: list[str] | None = option(
        None, "Rename keys, such as viewer/1:=viewer/3, also inside messages; may be repeated.", metavar="OLD:=NEW"
    )
    delay: float = option(1.0, "Time for discovery before the start (s).", min=0, max=3600, metavar="SECONDS")
    remote: RemoteOption = False
    certificates: Path | None = option(
        None,
        "Certificates for a secured rig, from `zenocap certs RIG --service replay`; needs --mode client.",
        metavar="DIR",
        rich_help_panel=PANEL,
    )


def replay(
    takes: Takes, *, given: ReplayArguments, span: FrameRange, expert: Annotated[ReplayExpert, EXPERT],
    zenoh: ZenohArguments,
) -> None:  # fmt: skip
    """Publish the messages of takes on the network again.

    The same bytes on the same keys, at the recorded intervals. To look at a take, use `zenocap show`; to recompute it,
    `zenocap verify`.

    The replay acts as the services whose messages it publishes, and does not start while one of them is running. Latched
    messages from before --from, such as calibrations, are published first. Times of --from and --until count from the
    take's first message. Keys in a terminal: space pauses, . makes one step, the arrows left and right jump 5 s, + and -
    change the rate, q quits. Exit status 3: played, but parts of the take were cut or damaged.

    Example: `zenocap replay monday.mcap`, or `zenocap replay monday.mcap --topics 'viewer/**'` for a live integrator
    """
    from rich.console import Console

    from zenocap.common.runtime import logs
    from zenocap.common.runtime.signals import stop_signals

    with one_line_errors(), stop_signals() as stopped:
        from zenocap.tools.record.replay.shell import run_replay

        for take in takes:
            checked_take(take)
        options = _options(given, span, expert)
        logs.configure("replay")
        session = _session(zenoh, expert.certificates)
        try:
            raise typer.Exit(run_replay(takes, options, session, stopped, Console()))
        except ValueError as error:
            raise typer.BadParameter(str(error)) from error


def _options(given: ReplayArguments, span: FrameRange, expert: ReplayExpert) -> ReplayOptions:
    """Raises typer.BadParameter."""
    from zenocap.tools.record.replay.remap import Remapping, parsed_remap
    from zenocap.tools.record.replay.selection import ReplaySelection
    from zenocap.tools.record.replay.shell import ReplayOptions

    first, last = span.bounds()
    try:
        selection = ReplaySelection(tuple(given.topics or ()), tuple(given.exclude or ()))
        remapping = Remapping(tuple(map(parsed_remap, expert.remap or ())), given.rig)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    return ReplayOptions(
        selection, remapping, first, last, given.rate, given.loop, given.pause, given.now, expert.delay, expert.remote
    )


def _session(zenoh: ZenohArguments, certificates: Path | None) -> ZenohOptions:
    """Raises UserError."""
    from zenocap.common.bus.access import REPLAY
    from zenocap.common.rig.security import security_in

    options = zenoh.options()
    return options if certificates is None else replace(options, security=security_in(certificates, REPLAY))
