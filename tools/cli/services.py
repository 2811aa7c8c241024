"""Commands of the services that take no images: integrator, tracker, recognizer, animator, router."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.common.errors import UserError
from zenocap.tools.cli.options import DONE, NoLogOption, RigPath, one_line_errors, rig_at, take_folder
from zenocap.tools.option_groups import option
from zenocap.tools.service_arguments import RouterArguments, ServiceArguments, security

if TYPE_CHECKING:  # imported where it is used: `zenocap --help` answers at once
    from zenocap.common.rig.rig import Rig


def integrator(
    rig: RigPath,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", help="Take to write; default: a new name of rig and time."),
    ] = None,
    no_log: NoLogOption = False,
    recordings: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of takes that a page starts; default: that of --output, or the rig's."),
    ] = None,
    *,
    arguments: ServiceArguments,
) -> None:
    """Run the integrator of a rig, which also records the take.

    It pairs the viewers' sightings, assigns their roles, and fuses their angles to the pose. The take has every message
    of the rig. It runs until Ctrl-C. Exit status 3: messages were lost, or the take could not be written.

    Example: `zenocap integrator studio.toml -o monday.mcap`
    """
    import time

    from zenocap.common.recording.parts import free_name, take_path
    from zenocap.services.integrator.shell import run_integrator
    from zenocap.tools.parameters import service_parameters

    with one_line_errors(), arguments.running("integrator") as stopped:
        one = rig_at(rig, files=False)
        options = arguments.options(one, "integrator")
        folder = take_folder(one, rig, recordings or (None if output is None else output.parent))
        take = None
        if output is not None:
            take = free_name(output) if arguments.with_parent else output
        elif one.log.enabled and not no_log:
            take = take_path(one.name, folder, time.time_ns())
        # A take that was requested must be written; a default one, or the launcher's, must not stop the tracking.
        must_log = output is not None and not arguments.with_parent
        parameters = service_parameters(one)
        raise typer.Exit(run_integrator(one, options, folder, take, stopped, parameters, must_log=must_log))


def tracker(rig: RigPath, *, arguments: ServiceArguments) -> None:
    """Run the tracker of a rig: from silhouettes to the pose.

    For a rig with method hybrid; it publishes the pose and its uncertainty. It uses the silhouettes of two or more of
    the rig's viewers, which may come and go. The body is measured while the person stands in the T-pose (arms stretched
    sideways). It runs until Ctrl-C.

    Example: `zenocap tracker studio.toml`
    """
    from zenocap.common.rig.methods import method_of, tracker_methods
    from zenocap.services.tracker.shell import run_tracker

    with one_line_errors(), arguments.running("tracker") as stopped:
        one = rig_at(rig, files=False)
        if not method_of(one.method).has_tracker:
            raise UserError(f"{rig}: method = {one.method!r}: allowed for a tracker: {', '.join(tracker_methods())}")
        raise typer.Exit(run_tracker(one, arguments.options(one, "tracker"), stopped))


def recognizer(
    rigs: Annotated[
        list[Path], typer.Argument(metavar="RIG...", help="Rig files, or folders with calibration.toml and videos/.")
    ],
    model: Annotated[
        str | None, typer.Option(metavar="NAME|FILE", help="Posture model; default: the rig's, else `fifteen`.")
    ] = None,
    commands: Annotated[
        bool, typer.Option("--commands/--no-commands", help="Whether postures trigger the commands of the rigs.")
    ] = True,
    *,
    arguments: ServiceArguments,
) -> None:
    """Run the posture recognizer of one or more rigs.

    Receives poses of the integrator or the tracker, and publishes each posture with its start and end, within half a
    second of its end; a movement that no model explains is published without a label. Runs until Ctrl-C. A rig that
    fails does not stop the others.

    Example: `zenocap recognizer studio.toml lab.toml`
    """
    from zenocap.services.recognizer.shell import run_recognizers

    if arguments.listen and len(rigs) > 1:
        raise typer.BadParameter("--listen with several rigs: allowed: `listen` in the zenoh table of each")
    with one_line_errors(), arguments.running("recognizer") as stopped:
        found = [with_recognizer(rig_at(rig, files=False), model, commands=commands) for rig in rigs]
        options = [arguments.options(rig, "recognizer") for rig in found]
        raise typer.Exit(run_recognizers(list(zip(found, options, strict=True)), stopped))


def with_recognizer(rig: Rig, model: str | None, *, commands: bool = True) -> Rig:
    """The rig with a recognizer: its own, or the defaults.  model: instead of its own.  commands: whether to keep them.

    Raises UserError.
    """
    from zenocap.common.rig.recognizer import RecognizerTable, find_postures, recognizer_spec
    from zenocap.common.rig.table_errors import TableError

    try:
        spec = rig.recognizer
        if spec is None:
            table = RecognizerTable() if model is None else RecognizerTable(model=model)
            spec = recognizer_spec(table, rig.method, Path())
        elif model is not None:
            spec = replace(spec, model=find_postures(model, Path()))
    except TableError as error:
        raise UserError(f"--{error}" if model is not None else f"rig {rig.name}: recognizer.{error}") from error
    return replace(rig, recognizer=spec if commands else replace(spec, commands=()))


@dataclass(frozen=True)
class AnimatorArguments:
    """Address of the page; recordings: folder of the takes that it can play."""

    host: str | None = option(None, "Address of the page on this machine; default: the rig's, or 127.0.0.1.")
    port: int | None = option(None, "Port of the page, 0 for any free one; default: the rig's, or 8080.", min=0, max=65535)
    token: str | None = option(
        None,
        "Access token of the page; required with a --host that other machines can reach. `new` generates and prints one.",
    )
    recordings: Path | None = option(None, "Folder of the takes that the page can play; default: the rig's.", metavar="DIR")


def animator(rig: RigPath, *, given: AnimatorArguments, arguments: ServiceArguments) -> None:
    """Show a live rig on a page, and send its poses to its outputs.

    Open http://127.0.0.1:8080 in any browser. The page shows the virtual actor, the views of the cameras, the state of
    every service, and during the set-up what to correct. It loads nothing from other servers. Other machines can open
    it only with --host and --token. For a recorded take, use `zenocap show`.

    Example: `zenocap animator studio.toml`
    """
    from zenocap.services.animator.shell import run_animator

    with one_line_errors(), arguments.running("animator") as stopped:
        if rig.suffix == ".mcap":
            raise UserError(f"{rig} is a take; zenocap show {rig} shows it")
        loaded = _with_page(rig_at(rig, files=False), given)
        options = arguments.options(loaded, "animator")
        raise typer.Exit(run_animator(loaded, take_folder(loaded, rig, given.recordings), options, stopped))


def _with_page(rig: Rig, given: AnimatorArguments) -> Rig:
    """The rig with its page at that address, as far as it is given.  Raises UserError."""
    from secrets import token_urlsafe

    import msgspec

    from zenocap.common.rig.animator import PageTable, open_page_problem

    token = token_urlsafe(24) if given.token == "new" else given.token
    values = {"host": given.host, "port": given.port, "token": token}
    values = {name: value for name, value in values.items() if value is not None}
    try:
        page = msgspec.convert(msgspec.to_builtins(rig.animator.page) | values, PageTable)
    except msgspec.ValidationError as error:
        raise UserError(f"page: {error}") from error
    if problem := open_page_problem(page):
        raise UserError(f"animator.page.host = {page.host!r}: {problem}")
    return replace(rig, animator=msgspec.structs.replace(rig.animator, page=page))


def router(
    rigs: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[RIG...]", help="Rigs with a [security] table: only their members are admitted."),
    ] = None,
    *,
    zenoh: RouterArguments,
) -> None:
    """Run a Zenoh router, where services cannot discover each other.

    For rigs with a [security] table it admits holders of a certificate only (see `zenocap certs`); each may publish only
    the topics of its own service. Without a rig it is open to everyone who can reach it.

    Example: `zenocap router -l tcp/0.0.0.0:7447`, and on the other machines `-m client -e tcp/HOST:7447`;
    `zenocap router studio.toml lab.toml` for secured rigs.
    """
    from zenocap.common.bus.zenoh_router import router as run_router
    from zenocap.common.rig.security import router_files
    from zenocap.common.runtime import logs
    from zenocap.common.runtime.signals import stop_signals

    logs.configure("router")
    with one_line_errors(), stop_signals() as stopped:
        secured_rigs = [rig_at(rig, files=False) for rig in rigs or ()]
        run_router(
            lambda revocations: zenoh.router_options(security(secured_rigs, "router", revocations.generations)),
            stopped,
            router_files(secured_rigs),
        )
        raise typer.Exit(DONE)
