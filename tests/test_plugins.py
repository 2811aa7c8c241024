"""Example packages of `examples/plugin`: installed, and chosen as zenocap's own."""

import json
import os
import shutil
import socket
import subprocess
import sys
import textwrap
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import yaml

from tests.common.rig.test_animator import RIG as RIG_TEXT
from tests.common.rig.test_animator import write_rig
from tests.support.mjpeg_server import MjpegServer
from tests.support.places import GOLDEN, ROOT
from tests.support.processes import PATIENCE_S
from tests.support.simulated_cameras import paper_cameras
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.rig.rig import demo_rig_file, load_rig

pytestmark = pytest.mark.core
PLUGINS = ROOT / "examples" / "plugin"
Ended = subprocess.CompletedProcess[str]


@dataclass(frozen=True)
class Installation:
    """An environment with packages; each program in it is a process."""

    environment: dict[str, str]

    def zenocap(self, *arguments: str | Path) -> Ended:
        return self._ended("-P", "-m", "zenocap", *map(str, arguments))

    def refused(self, *arguments: str | Path) -> str:
        """The error of a command that fails, as one line."""
        done = self.zenocap(*arguments)
        assert done.returncode == 1, done.stdout
        return done.stderr.replace("\n", " ")

    def printed(self, code: str, *arguments: str) -> str:
        """The output of a program that uses the installed package and tests.support."""
        done = self._ended("-c", textwrap.dedent(code), *arguments)
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    def _ended(self, *words: str) -> Ended:
        command = [sys.executable, *words]
        return subprocess.run(command, env=self.environment, cwd=ROOT, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Installation:
    """All example packages; built from copies, since a build leaves files beside its sources."""
    folder = tmp_path_factory.mktemp("plugins")
    copies = [shutil.copytree(path, folder / "sources" / path.name) for path in PLUGINS.iterdir() if path.is_dir()]
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation"]
    subprocess.run([*pip, "--target", folder / "site", *copies], check=True)
    path = os.pathsep.join([str(folder / "site"), *filter(None, [os.environ.get("PYTHONPATH")])])
    return Installation({**os.environ, "PYTHONPATH": path})


def test_a_format_of_a_package_is_exported_by_its_suffix(installed: Installation, tmp_path: Path) -> None:
    done = installed.zenocap("export", GOLDEN / "arms.mcap", "-o", tmp_path / "arms.sto")
    assert (done.returncode, done.stderr) == (0, "")
    assert "97 frames" in done.stdout
    head, kind, version, end, names, *rows = (tmp_path / "arms.sto").read_text().splitlines()
    assert (head, kind, version, end) == ("arms", "DataType=Vec3", "version=3", "endheader")
    assert names.split("\t")[0] == "time"
    assert len(rows) == 97
    assert {len(row.split("\t")) for row in rows} == {len(names.split("\t"))}
    done = installed.zenocap("export", GOLDEN / "arms.mcap", "-o", tmp_path / "arms.fbx")
    assert done.returncode == 2
    assert ".sto" in done.stderr.replace("\n", "")  # beside the suffixes of zenocap


def test_a_format_of_a_package_is_saved_by_the_page(installed: Installation, tmp_path: Path) -> None:
    shutil.copy(GOLDEN / "arms.mcap", tmp_path)
    code = """
        import sys, threading
        from pathlib import Path
        from zenocap.services.animator.page.save_messages import SaveTake
        from zenocap.services.animator.save_command import format_choices
        from zenocap.services.animator.save_job import SaveJob
        take, states, ended = Path(sys.argv[1]), [], threading.Event()
        def keep(update):
            states.append(update)
            if update.state != "running":
                ended.set()
        SaveJob(keep, lambda path: "").start(SaveTake("sto", axes="opensim"), take, take.parent)
        ended.wait()
        print(format_choices()[-1].name, states[-1].state, states[-1].name, states[-1].text)
    """
    found = installed.printed(code, str(tmp_path / "arms.mcap"))
    assert found.startswith("sto done arms.sto 97 frames")
    assert "DataType=Vec3" in (tmp_path / "arms.sto").read_text()


def test_recorded_motion_of_a_package_is_a_truth(installed: Installation, tmp_path: Path) -> None:
    truth = tmp_path / "arms.sto"
    installed.zenocap("export", GOLDEN / "arms.mcap", "-o", truth)
    arguments = ("evaluate", GOLDEN / "arms.mcap", "--truth", truth, "--centres")
    assert json.loads(installed.zenocap(*arguments, "--json").stdout)["mpjpe_mm"] < 0.01
    truth.write_text("arms\nendheader\ntime\tHip\n0.0\t1,2,3\n")
    assert "two rows or more" in installed.refused(*arguments)


def test_an_output_of_a_package_gets_the_poses_of_a_rig(installed: Installation, tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listening:
        listening.bind(("127.0.0.1", 0))
        listening.settimeout(PATIENCE_S)
        rig = write_rig(tmp_path, f"{RIG_TEXT}[animator.osc]\nport = {listening.getsockname()[1]}\n")
        code = """
            import sys
            from tests.support.virtual_actors import stretched
            from zenocap.common.rig.rig import load_rig
            from zenocap.common.runtime.clock import RealClock
            from zenocap.services.animator.outputs.output_group import open_outputs
            outputs = open_outputs(load_rig(sys.argv[1]).animator, "studio", RealClock())
            outputs.send(stretched("ten-parts"), None)
            print(outputs.counts())
        """
        found = installed.printed(code, str(rig))
        first = listening.recv(1000)
    assert "'osc_sent': 15" in found
    assert first.startswith(b"/zenocap/Hip")


def test_a_wrong_key_of_a_packages_table_is_an_error_with_the_allowed_ones(installed: Installation, tmp_path: Path) -> None:
    rig = write_rig(tmp_path, f"{RIG_TEXT}[animator.osc]\nprot = 1\n")
    error = installed.refused("animator", rig)
    assert "animator.osc.prot = 1: no such key; allowed: enabled, host, port, root" in error


@pytest.fixture
def camera() -> Iterator[MjpegServer]:
    """A network camera that asks for a password, and whose clock began an hour ago."""
    begin_s = time.monotonic() - 3600.0
    with MjpegServer((64, 48), 20.0, user=("me", "se:cret"), clock_s=lambda: time.monotonic() - begin_s) as running:
        yield running


def with_password(installed: Installation, home: Path, password: str = "se:cret") -> Installation:
    """That of a user whose ~/.netrc has a password for this machine."""
    (home / ".netrc").write_text(f"machine 127.0.0.1 login me password {password}\n")
    (home / ".netrc").chmod(0o600)
    return Installation({**installed.environment, "HOME": str(home)})


def test_a_source_of_a_package_is_filmed(installed: Installation, camera: MjpegServer, tmp_path: Path) -> None:
    film = ("-o", tmp_path / "film", "--size", "64x48", "--fps", "20", "--seconds", "1")
    done = with_password(installed, tmp_path).zenocap("film", f"a=mjpeg:{camera.url}", *film)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "film" / "videos" / "a.mkv").is_file()
    assert "secret" not in done.stdout + done.stderr


def test_a_source_of_a_package_is_that_of_a_viewer_and_has_its_own_times(
    installed: Installation, camera: MjpegServer, tmp_path: Path
) -> None:
    """Its images are opened, paced and counted as those of any stream."""
    code = """
        import sys, time
        from itertools import islice
        from pathlib import Path
        from zenocap.common.rig.source_kinds import parse_source
        from zenocap.common.runtime.clock import RealClock
        from zenocap.services.viewer.sources.device import camera_frames
        from zenocap.services.viewer.sources.playback import Playback
        from zenocap.services.viewer.sources.stamps import SourceRate
        source, rate, size = parse_source(sys.argv[1], Path()), SourceRate(), (64, 48)
        playback = Playback(time.time_ns(), RealClock())
        frames = [*islice(camera_frames(source, 100.0, size, playback, rate=rate), 20)]
        print([frame.frame for frame in frames] == [*range(20)], source.live, source.stamps, source.shown)
    """
    found = with_password(installed, tmp_path).printed(code, f"mjpeg:{camera.url}")
    assert found == f"True True stream mjpeg:{camera.url}"


@pytest.mark.parametrize(
    ("source", "reason"),
    [
        ("mjpeg:{url}", "user and password: allowed: those in ~/.netrc for this host"),
        ("mjpeg:http://me:se:cret@127.0.0.1/x", "user and password are those of ~/.netrc"),
        ("ftp://127.0.0.1/x", "discover:MACHINE/CAMERA, mjpeg:..."),
    ],
)
def test_a_source_of_a_package_says_what_is_wrong_without_the_password(
    installed: Installation, camera: MjpegServer, tmp_path: Path, source: str, reason: str
) -> None:
    film = ("film", f"a={source.format(url=camera.url)}", "-o", tmp_path / "film", "--seconds", "1")
    done = with_password(installed, tmp_path, "wrong").zenocap(*film)
    assert (done.returncode, reason in done.stderr.replace("\n", " ")) == (1, True), done.stderr
    assert "se:cret" not in done.stdout + done.stderr


def test_a_camera_host_opens_own_sources_only(installed: Installation, tmp_path: Path) -> None:
    host = ("viewer", "--discover", "--camera", "a=mjpeg:http://127.0.0.1/x", "--films", tmp_path)
    error = installed.refused(*host)
    assert "discover:MACHINE/CAMERA" in error
    assert "mjpeg:..." not in error


def test_the_digest_of_a_rig_does_not_depend_on_what_is_installed(installed: Installation) -> None:
    found = installed.printed("from zenocap.common.rig.rig import demo_rig; print(demo_rig().digest)")
    assert found == load_rig(demo_rig_file()).digest


def test_a_calibration_of_a_package_is_converted(installed: Installation, tmp_path: Path) -> None:
    """The cameras stand to each other as before, in the world of the first one."""
    one, two = paper_cameras((640, 480))[:2]
    rotation = two.rotation @ one.rotation.T
    between = np.eye(4)
    between[:3, :3], between[:3, 3] = rotation, two.translation - rotation @ one.translation
    chain = {
        f"cam{number}": {
            "camera_model": "pinhole", "distortion_model": "radtan",
            "intrinsics": [float(camera.matrix[row]) for row in ((0, 0), (1, 1), (0, 2), (1, 2))],
            "distortion_coeffs": [0.1, -0.01, 0.001, 0.002], "resolution": list(camera.size), "T_cn_cnm1": between.tolist(),
        }
        for number, camera in enumerate((one, two))
    }  # fmt: skip
    (tmp_path / "camchain.yaml").write_text(yaml.safe_dump(chain))
    done = installed.zenocap("calibrate", "convert", tmp_path / "camchain.yaml", "-o", tmp_path / "c.toml")
    assert (done.returncode, done.stderr) == (0, "")
    first, second = read_calibration(tmp_path / "c.toml").values()
    np.testing.assert_allclose(first.centre, 0.0, atol=1e-12)
    np.testing.assert_allclose(first.rotation.T @ [0.0, -1.0, 0.0], [0.0, 1.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(second.rotation @ first.rotation.T, rotation, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(second.centre), np.linalg.norm(two.centre - one.centre))
    np.testing.assert_allclose(second.matrix, two.matrix)
    np.testing.assert_allclose(second.distortions, [0.1, -0.01, 0.001, 0.002])
    (tmp_path / "camchain.yaml").write_text("cam0:\n  camera_model: omni\n")
    error = installed.refused("calibrate", "check", tmp_path / "camchain.yaml")
    assert "cam0.distortion_model is missing; there are: camera_model" in error


def test_a_detector_of_a_package_finds_points_and_needs_no_model(installed: Installation) -> None:
    """A green square at columns 20 to 29, rows 40 to 49, and no magenta one."""
    code = """
        import numpy as np
        from zenocap.common.rig.detectors import DETECTORS
        row = DETECTORS.row("bands")
        image = np.full((120, 160, 3), 90, np.uint8)
        image[40:50, 20:30] = 0, 255, 0
        points, visible = row.loaded()(image, (10, 10, 150, 110))
        print(DETECTORS.names(), row.points, points.tolist(), visible.tolist())
    """
    found = "('people', 'bands') ('RWrist', 'LWrist') [[24.5, 44.5], [nan, nan]] [1.0, 0.0]"
    assert installed.printed(code) == found
    assert installed.zenocap("models", "list").stdout.splitlines()[0].startswith("people: ")
    assert "'bands': needs no model file" in installed.zenocap("models", "add", "bands").stderr.replace("\n", " ")


@pytest.mark.parametrize("given", [False, True], ids=["of the rig", "by --method"])
def test_a_method_of_a_package_tracks_and_is_not_verified(installed: Installation, given: bool, tmp_path: Path) -> None:
    shutil.copy(demo_rig_file().with_name("demo-calibration.toml"), tmp_path)
    viewers = "".join(
        f'[[viewer]]\nid = "{k}"\ncamera = "cam0{k}"\nsource = "actor:raise-both-arms?seed=7"\nbackground = "first:30"\n'
        "size = [160, 120]\nfps = 15\n"
        for k in (1, 2)
    )
    head = f'name = "arms"\nmethod = "{"two-view" if given else "upright"}"\ncalibration = "demo-calibration.toml"\n'
    (tmp_path / "rig.toml").write_text(head + viewers)
    take = tmp_path / "a.mcap"
    done = installed.zenocap("track", tmp_path / "rig.toml", "-o", take, *(["--method", "upright"] if given else []))
    assert done.returncode in (0, 3), done.stderr  # 3: its verdict is doubtful
    assert "method upright" in installed.zenocap("info", take).stdout
    assert "nothing can be verified" in installed.zenocap("verify", take).stderr
    assert "'upright': allowed: two-view, hybrid" in Installation(dict(os.environ)).refused("verify", take)
