"""Set-up of a rig over several machines, which are processes here."""

import signal
import subprocess
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from tests.support.mjpeg_server import MjpegServer
from tests.support.networks import free_endpoint
from tests.support.processes import ended, output_of, started, wait_until
from tests.support.simulated_cameras import paper_cameras
from tests.system.test_film import FPS, NAMES, SIZE, Scene
from tests.system.test_setup import setup
from zenocap.common.bus.zenoh_session import free_ports
from zenocap.common.camera.calibration_files import write_calibration

pytestmark = pytest.mark.nightly  # a first take of a few seconds, in which a busy machine may have no pose


class WaitingScene(Scene):
    """Its person comes some seconds after all cameras were opened, which is before their viewers take frames."""

    def picture(self, camera: int) -> Callable[[], np.ndarray]:
        looked: Counter[int] = self.__dict__.setdefault("looked", Counter())

        def now() -> np.ndarray:
            looked[camera] += 1
            if min(looked[k] for k in range(len(NAMES))) > 3 * FPS:
                self.begin_s = self.begin_s or time.monotonic()
            k = 0 if self.begin_s is None else int((time.monotonic() - self.begin_s) * FPS)
            return self.images[camera][min(k, len(self.images[camera]) - 1)]

        return now


class Machines:
    """A router, and two machines on which `zenocap viewer --discover` runs, each with its own data folder."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        self.place = (free_endpoint(), "--no-multicast-scouting")
        self.network = ("-m", "client", "-e", *self.place)
        self.folder, self.stack = folder, stack
        scene = WaitingScene()
        self.urls = [stack.enter_context(MjpegServer(SIZE, FPS, picture=scene.picture(k))).url for k in range(2)]
        stack.enter_context(started(["router", "-l", *self.place], folder))
        self.folders = [folder / f"lab{k}" for k in range(2)]
        self.processes = [self.start(k) for k in range(2)]
        for place in self.folders:
            wait_until(lambda place=place: "announces" in output_of(place), place)

    def start(self, k: int) -> subprocess.Popen[str]:
        self.folders[k].mkdir(exist_ok=True)
        arguments = ["viewer", "--discover", "--machine", f"lab{k}", "--camera", f"cam={self.urls[k]}", *self.network]
        environment = {"XDG_DATA_HOME": str(self.folders[k] / "data")}
        return self.stack.enter_context(started(arguments, self.folders[k], environment))


@pytest.fixture(scope="module")
def machines(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Machines]:
    with ExitStack() as stack:
        yield Machines(tmp_path_factory.mktemp("machines"), stack)


def test_cameras_of_two_machines_are_set_up_from_a_third_to_a_take_with_poses(machines: Machines) -> None:
    folder = machines.folder
    write_calibration(folder / "known.toml", dict(zip(NAMES, paper_cameras(SIZE), strict=True)))
    shape = ("--size", f"{SIZE[0]}x{SIZE[1]}", "--fps", f"{FPS:g}")
    cameras = [f"{name}=discover:lab{k}/cam" for k, name in enumerate(NAMES)]
    status, text = setup(folder, "y\nf\nknown.toml\n", *cameras, *shape, *machines.network)
    assert status == 1, text
    assert "pictures stay on lab1: there, run: zenocap cameras --live" in text
    assert "Step 5 of 5" in text
    rig = folder / "studio" / "rig.toml"
    assert 'source = "discover:lab0/cam"' in rig.read_text()
    (port,) = free_ports(1)
    rig.write_text(rig.read_text() + f"\n[animator.page]\nport = {port}\n")
    status, text = setup(folder, "\n", "--seconds", "40")
    assert status == 0, text
    assert "viewer cam01 runs on lab0" in text
    assert "first pose" in text
    for place in machines.folders:
        assert "released" in output_of(place)
        assert not list((place / "data").rglob("*.json"))


def test_a_machine_that_is_killed_and_started_again_goes_on_by_itself(machines: Machines) -> None:
    place = machines.folder / "up"
    place.mkdir()
    rig = machines.folder / "studio" / "rig.toml"
    with started(["up", rig, "--no-page", "--no-log"], place) as up:
        wait_until(lambda: "viewer cam02 runs on lab1" in output_of(place), place)
        machines.processes[1].kill()
        wait_until(
            lambda: "viewer cam02: no machine lab1 announces its cameras (there are: lab0)" in output_of(place), place
        )
        (machines.folders[1] / "before").mkdir()
        for path in machines.folders[1].glob("*.err"):
            path.rename(path.parent / "before" / path.name)
        machines.processes[1] = machines.start(1)
        wait_until(lambda: "viewer cam02 of rig studio: assigned" in output_of(machines.folders[1]), machines.folders[1])
        wait_until(lambda: output_of(place).count("viewer cam02 runs on lab1") == 2, place)
        assert ended(up, signal.SIGINT) == 0, output_of(place)
    assert not list((machines.folders[1] / "data").rglob("*.json"))
