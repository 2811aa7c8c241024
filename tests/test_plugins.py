"""Example packages of `examples/plugin`: installed, and chosen as zenocap's own."""

import json
import os
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
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

PLUGINS = ROOT / "examples" / "plugin"


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Environment with all example packages; built from copies, since a build leaves files beside its sources."""
    folder = tmp_path_factory.mktemp("plugins")
    copies = [shutil.copytree(path, folder / "sources" / path.name) for path in PLUGINS.iterdir() if path.is_dir()]
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation"]
    subprocess.run([*pip, "--target", folder / "site", *copies], check=True)
    path = os.pathsep.join([str(folder / "site"), *filter(None, [os.environ.get("PYTHONPATH")])])
    return {**os.environ, "PYTHONPATH": path}


def zenocap(environment: dict[str, str], *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-P", "-m", "zenocap", *map(str, arguments)]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.core
def test_a_format_of_a_package_is_exported_by_its_suffix(installed: dict[str, str], tmp_path: Path) -> None:
    done = zenocap(installed, "export", GOLDEN / "arms.mcap", "-o", tmp_path / "arms.sto")
    assert (done.returncode, done.stderr) == (0, "")
    assert "97 frames" in done.stdout
    head, kind, version, end, names, *rows = (tmp_path / "arms.sto").read_text().splitlines()
    assert (head, kind, version, end) == ("arms", "DataType=Vec3", "version=3", "endheader")
    assert names.split("\t")[0] == "time"
    assert len(rows) == 97
    assert {len(row.split("\t")) for row in rows} == {len(names.split("\t"))}


@pytest.mark.core
def test_a_suffix_that_nobody_writes_lists_that_of_the_package(installed: dict[str, str], tmp_path: Path) -> None:
    done = zenocap(installed, "export", GOLDEN / "arms.mcap", "-o", tmp_path / "arms.fbx")
    assert done.returncode == 2
    assert ".sto" in done.stderr.replace("\n", "")


@pytest.mark.core
def test_recorded_motion_of_a_package_is_a_truth(installed: dict[str, str], tmp_path: Path) -> None:
    truth = tmp_path / "arms.sto"
    zenocap(installed, "export", GOLDEN / "arms.mcap", "-o", truth)
    done = zenocap(installed, "evaluate", GOLDEN / "arms.mcap", "--truth", truth, "--centres", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["mpjpe_mm"] < 0.01
    truth.write_text("arms\nendheader\ntime\tHip\n0.0\t1,2,3\n")
    done = zenocap(installed, "evaluate", GOLDEN / "arms.mcap", "--truth", truth, "--centres")
    assert (done.returncode, "two rows or more" in done.stderr) == (1, True)


@pytest.mark.core
def test_an_output_of_a_package_gets_the_poses_of_a_rig(installed: dict[str, str], tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listening:
        listening.bind(("127.0.0.1", 0))
        listening.settimeout(PATIENCE_S)
        rig = write_rig(tmp_path, f"{RIG_TEXT}[animator.osc]\nport = {listening.getsockname()[1]}\n")
        code = (
            "import sys\n"
            "from tests.support.virtual_actors import stretched\n"
            "from zenocap.common.rig.rig import load_rig\n"
            "from zenocap.common.runtime.clock import RealClock\n"
            "from zenocap.services.animator.outputs.output_group import open_outputs\n"
            "outputs = open_outputs(load_rig(sys.argv[1]).animator, 'studio', RealClock())\n"
            "outputs.send(stretched('ten-parts'), None)\n"
            "print(outputs.titles, outputs.counts())\n"
        )
        done = subprocess.run(
            [sys.executable, "-c", code, str(rig)], env=installed, cwd=ROOT, capture_output=True, text=True, check=True
        )
        first = listening.recv(1000)
    assert "animator.osc 127.0.0.1" in done.stdout
    assert "'osc_sent': 15" in done.stdout
    assert first.startswith(b"/zenocap/Hip")


@pytest.mark.core
def test_a_wrong_key_of_a_packages_table_is_an_error_with_the_allowed_ones(
    installed: dict[str, str], tmp_path: Path
) -> None:
    rig = write_rig(tmp_path, f"{RIG_TEXT}[animator.osc]\nprot = 1\n")
    done = zenocap(installed, "animator", rig)
    assert done.returncode == 1
    assert "animator.osc.prot = 1: no such key; allowed: enabled, host, port, root" in done.stderr.replace("\n", " ")


@pytest.fixture
def camera() -> Iterator[MjpegServer]:
    """A network camera that asks for a password, and whose clock began an hour ago."""
    begin_s = time.monotonic() - 3600.0
    with MjpegServer((64, 48), 20.0, user=("me", "se:cret"), clock_s=lambda: time.monotonic() - begin_s) as running:
        yield running


def with_password(environment: dict[str, str], home: Path, password: str = "se:cret") -> dict[str, str]:
    """The environment of a user whose ~/.netrc has a password for this machine."""
    (home / ".netrc").write_text(f"machine 127.0.0.1 login me password {password}\n")
    (home / ".netrc").chmod(0o600)
    return {**environment, "HOME": str(home)}


@pytest.mark.core
def test_a_source_of_a_package_is_filmed(installed: dict[str, str], camera: MjpegServer, tmp_path: Path) -> None:
    environment = with_password(installed, tmp_path)
    film = ("-o", tmp_path / "film", "--size", "64x48", "--fps", "20", "--seconds", "1")
    done = zenocap(environment, "film", f"a=mjpeg:{camera.url}", *film)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "film" / "videos" / "a.mkv").is_file()
    assert "secret" not in done.stdout + done.stderr


@pytest.mark.core
def test_a_source_of_a_package_is_that_of_a_viewer_and_has_its_own_times(
    installed: dict[str, str], camera: MjpegServer, tmp_path: Path
) -> None:
    """Its images are opened, paced and counted as those of any stream."""
    code = (
        "import sys, time\n"
        "from itertools import islice\n"
        "from pathlib import Path\n"
        "from zenocap.common.rig.source_kinds import parse_source\n"
        "from zenocap.common.runtime.clock import RealClock\n"
        "from zenocap.services.viewer.sources.device import camera_frames\n"
        "from zenocap.services.viewer.sources.playback import Playback\n"
        "from zenocap.services.viewer.sources.stamps import SourceRate\n"
        "source, rate, size = parse_source(sys.argv[1], Path()), SourceRate(), (64, 48)\n"
        "playback = Playback(time.time_ns(), RealClock())\n"
        "frames = [*islice(camera_frames(source, 100.0, size, playback, rate=rate), 20)]\n"
        "print([frame.frame for frame in frames] == [*range(20)], source.live, source.stamps, source.shown)\n"
    )
    command = [sys.executable, "-c", code, f"mjpeg:{camera.url}"]
    environment = with_password(installed, tmp_path)
    done = subprocess.run(command, env=environment, cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout == f"True True stream mjpeg:{camera.url}\n"


@pytest.mark.core
@pytest.mark.parametrize(
    ("source", "reason"),
    [
        ("mjpeg:{url}", "user and password: allowed: those in ~/.netrc for this host"),
        ("mjpeg:http://me:se:cret@127.0.0.1/x", "user and password are those of ~/.netrc"),
        ("ftp://127.0.0.1/x", "discover:MACHINE/CAMERA, mjpeg:..."),
    ],
)
def test_a_source_of_a_package_says_what_is_wrong_without_the_password(
    installed: dict[str, str], camera: MjpegServer, tmp_path: Path, source: str, reason: str
) -> None:
    environment = with_password(installed, tmp_path, "wrong")
    done = zenocap(environment, "film", f"a={source.format(url=camera.url)}", "-o", tmp_path / "film", "--seconds", "1")
    assert done.returncode == 1
    assert reason in done.stderr.replace("\n", " ")
    assert "se:cret" not in done.stdout + done.stderr


@pytest.mark.core
def test_a_camera_host_opens_own_sources_only(installed: dict[str, str], tmp_path: Path) -> None:
    done = zenocap(installed, "viewer", "--discover", "--camera", "a=mjpeg:http://127.0.0.1/x", "--films", tmp_path)
    assert done.returncode == 1
    assert "discover:MACHINE/CAMERA" in done.stderr
    assert "mjpeg:..." not in done.stderr


@pytest.mark.core
def test_the_digest_of_a_rig_does_not_depend_on_what_is_installed(installed: dict[str, str]) -> None:
    code = "from zenocap.common.rig.rig import demo_rig; print(demo_rig().digest)"
    done = subprocess.run([sys.executable, "-c", code], env=installed, cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == load_rig(demo_rig_file()).digest


@pytest.mark.core
def test_a_calibration_of_a_package_is_converted(installed: dict[str, str], tmp_path: Path) -> None:
    """The cameras stand to each other as before, in the world of the first one."""
    one, two = paper_cameras((640, 480))[:2]
    rotation = two.rotation @ one.rotation.T
    between = np.eye(4)
    between[:3, :3], between[:3, 3] = rotation, two.translation - rotation @ one.translation
    chain = {
        f"cam{number}": {
            "camera_model": "pinhole",
            "distortion_model": "radtan",
            "intrinsics": [float(camera.matrix[row]) for row in ((0, 0), (1, 1), (0, 2), (1, 2))],
            "distortion_coeffs": [0.1, -0.01, 0.001, 0.002],
            "resolution": list(camera.size),
            "T_cn_cnm1": between.tolist(),
        }
        for number, camera in enumerate((one, two))
    }
    (tmp_path / "camchain.yaml").write_text(yaml.safe_dump(chain))
    done = zenocap(installed, "calibrate", "convert", tmp_path / "camchain.yaml", "-o", tmp_path / "c.toml")
    assert (done.returncode, done.stderr) == (0, "")
    first, second = read_calibration(tmp_path / "c.toml").values()
    np.testing.assert_allclose(first.centre, 0.0, atol=1e-12)
    np.testing.assert_allclose(first.rotation.T @ [0.0, -1.0, 0.0], [0.0, 1.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(second.rotation @ first.rotation.T, rotation, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(second.centre), np.linalg.norm(two.centre - one.centre))
    np.testing.assert_allclose(second.matrix, two.matrix)
    np.testing.assert_allclose(second.distortions, [0.1, -0.01, 0.001, 0.002])


@pytest.mark.core
def test_a_wrong_calibration_of_a_package_names_key_and_value(installed: dict[str, str], tmp_path: Path) -> None:
    (tmp_path / "camchain.yaml").write_text("cam0:\n  camera_model: omni\n")
    done = zenocap(installed, "calibrate", "check", tmp_path / "camchain.yaml")
    assert done.returncode == 1
    assert "cam0.distortion_model is missing; there are: camera_model" in done.stderr.replace("\n", " ")


@pytest.mark.core
def test_a_detector_of_a_package_finds_points_and_needs_no_model(installed: dict[str, str]) -> None:
    """A green square at columns 20 to 29, rows 40 to 49, and no magenta one."""
    code = (
        "import numpy as np\n"
        "from zenocap.common.rig.detectors import DETECTORS\n"
        "row = DETECTORS.row('bands')\n"
        "image = np.full((120, 160, 3), 90, np.uint8)\n"
        "image[40:50, 20:30] = 0, 255, 0\n"
        "points, visible = row.loaded()(image, (10, 10, 150, 110))\n"
        "print(DETECTORS.names(), row.points, points.tolist(), visible.tolist())\n"
    )
    done = subprocess.run([sys.executable, "-c", code], env=installed, cwd=ROOT, capture_output=True, text=True, check=True)
    found = "('people', 'bands') ('RWrist', 'LWrist') [[24.5, 44.5], [nan, nan]] [1.0, 0.0]"
    assert done.stdout.strip() == found
    assert zenocap(installed, "models", "list").stdout.splitlines()[0].startswith("people: ")
    assert "'bands': needs no model file" in zenocap(installed, "models", "add", "bands").stderr.replace("\n", " ")


@pytest.mark.core
def test_a_method_of_a_package_tracks_and_is_not_verified(installed: dict[str, str], tmp_path: Path) -> None:
    shutil.copy(demo_rig_file().with_name("demo-calibration.toml"), tmp_path)
    viewers = "".join(
        f'[[viewer]]\nid = "{k}"\ncamera = "cam0{k}"\nsource = "actor:raise-both-arms?seed=7"\nbackground = "first:30"\n'
        "size = [160, 120]\nfps = 15\n"
        for k in (1, 2)
    )
    head = 'name = "arms"\nmethod = "upright"\ncalibration = "demo-calibration.toml"\n'
    (tmp_path / "rig.toml").write_text(head + viewers)
    take = tmp_path / "a.mcap"
    done = zenocap(installed, "track", tmp_path / "rig.toml", "-o", take)
    assert done.returncode in (0, 3), done.stderr  # 3: its verdict is doubtful
    assert "method upright" in zenocap(installed, "info", take).stdout
    assert "nothing can be verified" in zenocap(installed, "verify", take).stderr
    without = zenocap(dict(os.environ), "verify", take)
    assert (without.returncode, "'upright': allowed: two-view, hybrid" in without.stderr) == (1, True)
