"""Options of services: written as words and read again, and effective in every service."""

import os
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from zenocap.common.bus.protocol import BusError
from zenocap.common.bus.zenoh_session import ZenohOptions
from zenocap.common.rig.services import OF_RIGS
from zenocap.common.runtime import logs
from zenocap.tools.cli.main import command_at
from zenocap.tools.cli.viewer import _assigned_command
from zenocap.tools.option_groups import expanded
from zenocap.tools.service_arguments import ServiceArguments, arguments_of, words

EVERY = ServiceArguments(
    ["tcp/a:1", "tcp/b:2"], Path("zenoh.json5"), ["tcp/c:3"], no_multicast_scouting=True, mode="client", with_parent=True
)


def read(line: Sequence[str]) -> ServiceArguments:
    """The arguments that a command line gives."""
    found: list[ServiceArguments] = []

    def command(*, arguments: ServiceArguments) -> None:
        found.append(arguments)

    app = typer.Typer()
    app.command()(expanded(command))
    assert CliRunner().invoke(app, list(line)).exit_code == 0
    return found[0]


@pytest.mark.parametrize("arguments", [ServiceArguments(), ServiceArguments(listen=["tcp/c:3"]), EVERY])
def test_written_arguments_are_read_again(arguments: ServiceArguments) -> None:
    assert read(arguments.words()) == arguments


def test_every_argument_is_written() -> None:
    defaults = ServiceArguments()
    assert [name for name, value in vars(EVERY).items() if value == getattr(defaults, name)] == []


def test_options_of_a_session_become_arguments_of_a_process_that_ends_with_this_one() -> None:
    options = ZenohOptions("client", ("tcp/a:1", "tcp/b:2"), ("tcp/c:3",), Path("zenoh.json5"), multicast_scouting=False)
    assert arguments_of(options) == EVERY


def test_a_command_line_names_service_rig_and_viewer() -> None:
    line = words(("viewer", "7"), Path("a.toml"), ServiceArguments(with_parent=True), "--epoch-ns", "5")
    start = [sys.executable, "-P", "-m", "zenocap"]
    assert line == [*start, "viewer", "a.toml", "--id", "7", "--epoch-ns", "5", "--with-parent"]
    assert words(("integrator", "main"), Path("a.toml"), ServiceArguments()) == [*start, "integrator", "a.toml"]
    assert words(("viewer", "main"), None, ServiceArguments(), "--discover") == [*start, "viewer", "--discover"]


def test_every_service_takes_the_arguments_of_services() -> None:
    for name in OF_RIGS:
        assert "ServiceArguments" in command_at(name).__annotations__.values(), name


def test_the_viewer_of_an_assignment_connects_where_its_host_does_and_to_it() -> None:
    host = ServiceArguments(["tcp/a:1"], listen=["tcp/0.0.0.0:7", "tcp/[::]:8"], mode="router")
    line = _assigned_command(host, Path("films"), Path("a.json"))
    assert line[4:] == [
        "viewer", "--assigned", "a.json", "--films", "films", "--connect", "tcp/a:1",
        "--connect", "tcp/127.0.0.1:7", "--connect", "tcp/[::1]:8", "--mode", "client", "--with-parent",
    ]  # fmt: skip


def test_a_service_that_is_stopped_while_it_waits_for_a_router_has_not_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    """It was an error with status 1, for which the launcher blamed the service."""
    monkeypatch.setattr(logs, "configure", lambda _: None)

    def waits(*, stop: bool) -> None:
        with ServiceArguments().running("tracker") as stopped:
            if stop:
                os.kill(os.getpid(), signal.SIGTERM)
            assert stopped() == stop
            raise BusError("stopped while waiting for a router, or another error")

    with pytest.raises(typer.Exit) as end:
        waits(stop=True)
    assert end.value.exit_code == 0
    with pytest.raises(BusError):
        waits(stop=False)
