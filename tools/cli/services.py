"""Commands that run the services that take no images, and a router: integrator, tracker, router."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from zenocap.tools.cli.options import DONE, NoLogOption, RigPath, one_line_errors, rig_at, take_folder
from zenocap.tools.service_arguments import RouterArguments, ServiceArguments, security


def integrator(
    rig: RigPath,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", help="Take to write; default: a new name of rig and time."),
    ] = None,
    no_log: NoLogOption = False,
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
        take = None
        if output is not None:
            take = free_name(output) if arguments.with_parent else output
        elif one.log.enabled and not no_log:
            take = take_path(one.name, take_folder(one, rig, None), time.time_ns())
        # A take that was requested must be written; a default one, or the launcher's, must not stop the tracking.
        must_log = output is not None and not arguments.with_parent
        raise typer.Exit(run_integrator(one, options, take, stopped, service_parameters(one), must_log=must_log))


def tracker(rig: RigPath, *, arguments: ServiceArguments) -> None:
    """Run the tracker of a rig: from silhouettes to the pose.

    For a rig with method hybrid; it publishes the pose and its uncertainty. It uses the silhouettes of two or more of
    the rig's viewers, which may come and go. The body is measured while the person stands in the T-pose (arms stretched
    sideways). It runs until Ctrl-C.

    Example: `zenocap tracker studio.toml`
    """
    from zenocap.common.errors import UserError
    from zenocap.common.rig.methods import method_of, tracker_methods
    from zenocap.services.tracker.shell import run_tracker

    with one_line_errors(), arguments.running("tracker") as stopped:
        one = rig_at(rig, files=False)
        if not method_of(one.method).has_tracker:
            raise UserError(f"{rig}: method = {one.method!r}: allowed for a tracker: {', '.join(tracker_methods())}")
        raise typer.Exit(run_tracker(one, arguments.options(one, "tracker"), stopped))


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
