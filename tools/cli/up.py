"""Commands that run everything on this machine: demo and up; and warmup, which compiles for them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal, NoReturn

import typer

from zenocap.common.errors import UserError
from zenocap.tools.cli.options import DONE, FAILED, NoLogOption, RigPath, one_line_errors, rig_at, take_folder
from zenocap.tools.option_groups import option
from zenocap.tools.service_arguments import ZenohArguments

DEMO_PORT = 8080  # of the page; the default of a rig file


@dataclass(frozen=True)
class RunArguments:
    """seconds: None until Ctrl-C.  port: of the page."""

    seconds: float | None = option(None, "Running time (s); default: until Ctrl-C.", min=0.1)
    recordings: Path | None = option(
        None, "Folder of the takes; default: the rig's, or recordings for the demo.", metavar="DIR"
    )
    no_log: NoLogOption = False
    no_page: bool = option(False, "Run without the animator and its page.")
    port: int | None = option(
        None, "TCP port of the page, 0 for any free one; default: the rig's, or 8080.", min=0, max=65535
    )


def demo(
    *,
    given: RunArguments,
    method: Annotated[
        Literal["both", "auto", "two-view"],
        typer.Option(help="Tracking method: auto is the tracker, two-view the paper's two-view method in 160x120 images."),
    ] = "both",
) -> None:
    """Run everything with a simulated person: no camera needed.

    It runs on this machine and needs no network. Two viewers render the person from the front and from the side. They
    estimate the pose, the integrator fuses their results, and the tracker estimates it from the same silhouettes: a
    switch on the page at http://127.0.0.1:8080 selects one; where that port is taken, a free one is, and shown. With
    --method auto the tracker runs alone, with two-view the others. Every message is recorded to
    recordings/demo-TIME.mcap. A table shows the state of each service.

    Example: `zenocap demo --seconds 30`
    """
    from zenocap.common.rig.rig import demo_rig_file
    from zenocap.tools.cli.show import usual_port

    folder, port = given.recordings or Path("recordings"), usual_port(given.port, DEMO_PORT)
    _run(demo_rig_file(method), replace(given, recordings=folder, port=port), ZenohArguments(no_multicast_scouting=True))


def up(rig: RigPath, *, given: RunArguments, zenoh: ZenohArguments) -> None:
    """Run a rig on this machine, restart what fails, record a take.

    The services are processes that communicate over loopback; with --listen the integrator accepts connections from other
    machines. Cameras run until Ctrl-C, videos are played once at their own frame rate (FPS). To track every frame of
    videos, use `zenocap track`. At the end it lists the takes, and what became of all messages and frames: exit status 3
    when messages are in no take, or what a killed process sent or captured is in no count.

    Example: `zenocap up studio.toml`
    """
    _run(rig, given, zenoh)


def _run(path: Path, given: RunArguments, zenoh: ZenohArguments) -> NoReturn:
    import time

    from rich.console import Console

    from zenocap.common.recording.parts import take_path
    from zenocap.common.runtime.signals import stop_signals
    from zenocap.tools.cli.certs import renew_certificates
    from zenocap.tools.record.launcher.shell import run_rig

    with one_line_errors():
        rig = rig_at(path, files=True)
        renew_certificates(rig)
        options = zenoh.options(rig)
        is_logged = rig.log.enabled and not given.no_log
        folder = take_folder(rig, path, given.recordings)
        take = take_path(rig.name, folder, time.time_ns()) if is_logged else None
        page, port = not given.no_page, given.port
        with stop_signals() as stopped:
            raise typer.Exit(
                run_rig(rig, path, options, folder, take, given.seconds, stopped, Console(), page=page, port=port)
            )


def warmup(part: Annotated[list[str] | None, typer.Option(hidden=True)] = None) -> None:
    """Compile now what services would compile on their first start.

    demo and up do it when needed; run it before a take where a late start matters. Once per installation.

    Example: `zenocap warmup`
    """
    if part:
        from zenocap.tools.operate.warmup.parts import warm_up

        for one in part:
            warm_up(one)
        return
    from rich.console import Console

    from zenocap.common.runtime.signals import stop_signals
    from zenocap.tools.operate.warmup.parts import PARTS
    from zenocap.tools.operate.warmup.processes import cache_problem, compile_parts

    with one_line_errors(), stop_signals() as stopped:
        if problem := cache_problem():
            raise UserError(problem)
        raise typer.Exit(DONE if compile_parts(tuple(PARTS), stopped, Console(stderr=True)) else FAILED)
