"""The compose file built and run: data flows to the log and the page, a container that is killed comes back.

Where there is no docker, no compose, or no base image to be had, it is skipped and says so.
"""

import asyncio
import json
import os
import secrets
import shutil
import signal
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import WebSocketException

from services.launcher.mesh import free_ports

pytestmark = [pytest.mark.system, pytest.mark.timeout(1800)]
ROOT = Path(__file__).resolve().parents[1]
FILE = ROOT / "deploy" / "compose.yaml"
BASE = "python:3.11-slim-bookworm"
USER = 10001
LOSS = 3
PATIENCE_S = 240.0  # seven containers that all compile nothing, on a machine that has other things to do
Pieces = dict[str, dict[str, object]]


def compose_command() -> list[str] | None:
    """`docker compose`, or the older docker-compose."""
    if _succeeds(["docker", "compose", "version"]):
        return ["docker", "compose"]
    return ["docker-compose"] if shutil.which("docker-compose") else None


def problem() -> str | None:
    """Why nothing can be built here."""
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
    """A compose project of this test alone.  prefix: of its services."""

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
        self, *arguments: str, profile: str | None = None, seconds: float = 300.0, good: tuple[int, ...] = (0,)
    ) -> str:
        """What compose says.  Fails with all of it when the status is none of `good`."""
        chosen = ["--profile", profile or self._profile]
        command = [*self._command, "-p", self._name, "-f", str(FILE), *chosen, *arguments]
        done = subprocess.run(
            command, env=self._environment, capture_output=True, text=True, timeout=seconds, check=False
        )  # fmt: skip
        assert done.returncode in good, (
            f"{' '.join(arguments)}: {done.returncode}\n{done.stdout[-4000:]}\n{done.stderr[-4000:]}"
        )
        return done.stdout

    def inspect(self, service: str, what: str) -> str:
        id = self("ps", "-q", self.prefix + service).strip()
        assert id, f"{service} has no container"
        return subprocess.run(
            ["docker", "inspect", "-f", what, id], capture_output=True, text=True, check=True
        ).stdout.strip()

    async def page(self, found: Callable[[Pieces], bool], what: str) -> None:
        """Look at the page until something is so."""
        pieces: Pieces = {}

        async def look() -> None:
            address = f"ws://127.0.0.1:{self.port}/socket?token={self.token}"
            while True:
                try:
                    async with connect(address, compression=None, open_timeout=5) as connection:
                        while not found(pieces):
                            pieces.update({str(piece["is"]): piece for piece in json.loads(await connection.recv())})
                            await connection.send('{"is":"got"}')
                        return
                except (OSError, TimeoutError, WebSocketException):  # not up yet: the port is published before
                    await asyncio.sleep(0.5)

        try:
            await asyncio.wait_for(look(), PATIENCE_S)
        except TimeoutError:
            raise AssertionError(f"{what}: not seen; {pieces.get('rows')}\n{self('logs')[-6000:]}") from None


@pytest.fixture(params=["open", "secure"])
def project(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Project]:
    why = problem()
    if why is not None:
        pytest.skip(why)
    certificates = tmp_path / "certs"
    certificates.mkdir()
    if os.geteuid() == 0:
        os.chown(certificates, USER, USER)
        for parent in (tmp_path, *tmp_path.parents[:2]):  # pytest's own are for their user alone
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


def whole(after_frame: int) -> Callable[[Pieces], bool]:
    """A pose later than a frame, with the integrator tracking by both viewers."""

    def found(pieces: Pieces) -> bool:
        rows = pieces.get("rows", {}).get("rows", [])
        assert isinstance(rows, list)
        states = {str(row["name"]): str(row["state"]) for row in rows}
        frame = pieces.get("pose", {}).get("frame", -1)
        tracking = states.get("integrator", "").startswith("tracking") and "without" not in states["integrator"]
        return tracking and isinstance(frame, int) and frame > after_frame

    return found


def test_a_rig_in_containers_tracks_logs_shows_and_comes_back(project: Project) -> None:
    project("up", "-d", "--no-build")
    asyncio.run(project.page(whole(-1), "poses of both viewers"))
    page = f"http://127.0.0.1:{project.port}/"
    assert status_of(f"{page}?token={project.token}") == 200
    assert status_of(page) == 403
    for service in ("router", "integrator", "viewer-1", "viewer-2", "recognizer", "animator"):
        assert project.inspect(service, "{{.Config.User}} {{.HostConfig.ReadonlyRootfs}}") == f"{USER}:{USER} true"
    viewer = json.loads(project.inspect("viewer-2", "{{json .Config.Healthcheck.Test}}"))
    project("exec", "-T", f"{project.prefix}viewer-2", *viewer[1:])  # the question that the engine asks: status 0

    if os.geteuid() == 0:  # as a crash: what the engine kills itself it does not start again
        os.kill(int(project.inspect("viewer-2", "{{.State.Pid}}")), signal.SIGKILL)
        end_s = time.monotonic() + PATIENCE_S
        while project.inspect("viewer-2", "{{.RestartCount}} {{.State.Running}}") != "1 true":
            assert time.monotonic() < end_s, "viewer 2 was not started again"
            time.sleep(0.2)
        time.sleep(3)  # until its death has been noticed
        asyncio.run(project.page(whole(0), "both viewers again"))

    project("stop")
    found = project("run", "--rm", "--no-deps", "--entrypoint", "ls", f"{project.prefix}integrator", "/takes").split()
    takes = [name for name in found if name.endswith(".mcap")]
    assert len(takes) == 1
    info = json.loads(
        project("run", "--rm", "--no-deps", f"{project.prefix}integrator", "info", f"/takes/{takes[0]}", "--json")
    )
    assert info
    # What the viewer that was killed had not said of its last second cannot be checked: status 3.  A difference would be 1.
    verify = ("replay", "--verify", f"/takes/{takes[0]}")
    project("run", "--rm", "--no-deps", f"{project.prefix}integrator", *verify, good=(0, LOSS))
