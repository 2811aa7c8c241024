"""Compose file, built and run: poses reach take and page, a killed container restarts.

Skipped with a reason where docker, compose or the base image is missing.
"""

import asyncio
import json
import os
import secrets
import shutil
import signal
import subprocess
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import WebSocketException

from tests.support.places import ROOT
from zenocap.common.bus.zenoh_session import free_ports

pytestmark = [pytest.mark.core, pytest.mark.timeout(1800)]
FILE = ROOT / "deploy" / "compose.yaml"
BASE = "python:3.11-slim-bookworm"
USER = 10001
LOSS = 3
PATIENCE_S = 400.0  # seven containers on a busy machine (s)
Updates = dict[str, dict[str, object]]


def compose_command() -> list[str] | None:
    """`docker compose`, or the older docker-compose; None without either."""
    if _succeeds(["docker", "compose", "version"]):
        return ["docker", "compose"]
    return ["docker-compose"] if shutil.which("docker-compose") else None


def problem() -> str | None:
    """Reason why no image can be built here; None when it can."""
    if not _succeeds(["docker", "info"]):
        return "no docker, or no daemon that answers"
    if compose_command() is None:
        return "neither `docker compose` nor docker-compose"
    if not _succeeds(["docker", "image", "inspect", BASE]) and not _succeeds(["docker", "pull", BASE]):
        return f"the image {BASE} cannot be had"
    return None


def _succeeds(command: list[str]) -> bool:
    try:
        return subprocess.run(command, capture_output=True, timeout=300, check=False).returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        return False


class Project:
    """A compose project with a unique name.  prefix: of its services."""

    def __init__(self, profile: str, certificates: Path) -> None:
        self.prefix = "secure-" if profile == "secure" else ""
        self.token, (self.port,) = secrets.token_urlsafe(24), free_ports(1)
        self._command = compose_command() or []
        self._name = f"zenocaptest{os.getpid()}{profile}"
        self._profile = profile
        self._environment = os.environ | {
            "ZENOCAP_TOKEN": self.token, "ZENOCAP_PORT": str(self.port), "ZENOCAP_CERTS": str(certificates),
            "ZENOCAP_USER": f"{USER}:{USER}", "COMPOSE_PROFILES": "open", "DOCKER_BUILDKIT": "0",
        }  # fmt: skip

    def __call__(
        self, *arguments: str, profile: str | None = None, seconds: float = 300.0, allowed: tuple[int, ...] = (0,)
    ) -> str:
        """Output of a compose command.  Fails with all output when the exit status is not in `good`."""
        chosen = ["--profile", profile or self._profile]
        command = [*self._command, "-p", self._name, "-f", str(FILE), *chosen, *arguments]
        done = subprocess.run(
            command, env=self._environment, capture_output=True, text=True, timeout=seconds, check=False
        )  # fmt: skip
        assert done.returncode in allowed, (
            f"{' '.join(arguments)}: {done.returncode}\n{done.stdout[-4000:]}\n{done.stderr[-4000:]}"
        )
        return done.stdout

    def inspect(self, service: str, what: str) -> str:
        id = self("ps", "-q", self.prefix + service).strip()
        assert id, f"{service} has no container"
        return subprocess.run(
            ["docker", "inspect", "-f", what, id], capture_output=True, text=True, check=True
        ).stdout.strip()

    async def page(self, what: str, *conditions: Callable[[Updates], bool]) -> None:
        """Read the page until each of `conditions` was true, one after the other."""
        updates_seen: Updates = {}
        awaited = list(conditions)

        async def read_updates() -> None:
            address = f"ws://127.0.0.1:{self.port}/socket?token={self.token}"
            while True:
                try:
                    async with connect(address, compression=None, open_timeout=5) as connection:
                        while awaited:
                            if awaited[0](updates_seen):
                                awaited.pop(0)
                                continue
                            updates = json.loads(await connection.recv())
                            updates_seen.update({str(update["type"]): update for update in updates})
                            await connection.send('{"type":"acknowledge"}')
                        return
                except (OSError, TimeoutError, WebSocketException):  # not ready: the port is published first
                    await asyncio.sleep(0.5)

        try:
            await asyncio.wait_for(read_updates(), PATIENCE_S)
        except TimeoutError:
            raise AssertionError(f"{what}: not seen; {updates_seen.get('services')}\n{self('logs')[-6000:]}") from None


@pytest.fixture(params=["open", pytest.param("secure", marks=pytest.mark.nightly)])
def project(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Project]:
    reason = problem()
    if reason is not None:
        pytest.skip(reason)
    certificates = tmp_path / "certs"
    certificates.mkdir()
    if os.geteuid() == 0:
        os.chown(certificates, USER, USER)
        for parent in (tmp_path, *tmp_path.parents[:2]):  # pytest creates them for their owner only
            parent.chmod(0o755)
    one = Project(request.param, certificates)
    one("build", "router", profile="open", seconds=1500)
    if request.param == "secure":
        one("run", "--rm", "certs", profile="certs")
    try:
        yield one
    finally:
        one("down", "-v", "--remove-orphans")


def status_of(address: str) -> int:
    try:
        with urllib.request.urlopen(address, timeout=10) as answer:
            return int(answer.status)
    except urllib.error.HTTPError as error:
        return error.code


def tracked(updates_seen: Updates) -> bool:
    """True for a pose from an integrator that tracks with both viewers."""
    rows = updates_seen.get("services", {}).get("services", [])
    assert isinstance(rows, list)
    states = [(row["condition"], row["phase"]) for row in rows if row["name"] in ("viewer", "integrator")]
    return states == [("ok", "tracking")] * 3 and "pose" in updates_seen


def test_a_rig_in_containers_tracks_and_recovers(project: Project) -> None:
    project("up", "-d", "--no-build")
    asyncio.run(project.page("poses of both viewers", tracked))
    page = f"http://127.0.0.1:{project.port}/"
    assert status_of(f"{page}?token={project.token}") == 200
    assert status_of(page) == 403
    for service in ("router", "integrator", "viewer-1", "viewer-2", "recognizer", "animator"):
        assert project.inspect(service, "{{.Config.User}} {{.HostConfig.ReadonlyRootfs}}") == f"{USER}:{USER} true"
    viewer = json.loads(project.inspect("viewer-2", "{{json .Config.Healthcheck.Test}}"))
    project("exec", "-T", f"{project.prefix}viewer-2", *viewer[1:])  # the health check of the engine: status 0

    compiled = "all(os.path.isfile(one.__cached__) for one in (numpy, zenocap))"
    project("exec", "-T", f"{project.prefix}viewer-2", "python3", "-c", f"import os, numpy, zenocap; assert {compiled}")

    if os.geteuid() == 0:  # from outside: the engine does not restart what it kills itself
        viewer_pid = int(project.inspect("viewer-2", "{{.State.Pid}}"))

        def killed(_: Updates) -> bool:
            os.kill(viewer_pid, signal.SIGKILL)
            return True

        asyncio.run(project.page("both viewers again", tracked, killed, lambda updates: not tracked(updates), tracked))
        assert project.inspect("viewer-2", "{{.RestartCount}} {{.State.Running}}") == "1 true"

    project("stop")
    found = project("run", "--rm", "--no-deps", "--entrypoint", "ls", f"{project.prefix}integrator", "/takes").split()
    takes = [name for name in found if name.endswith(".mcap")]
    assert len(takes) == 1
    info = json.loads(
        project("run", "--rm", "--no-deps", f"{project.prefix}integrator", "info", f"/takes/{takes[0]}", "--json")
    )
    assert info
    # Messages of the killed viewer's last second cannot be verified: status 3.  A difference would be status 1.
    verify = ("verify", f"/takes/{takes[0]}")
    project("run", "--rm", "--no-deps", f"{project.prefix}integrator", *verify, allowed=(0, LOSS))
