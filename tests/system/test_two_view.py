"""The two-view system as processes on a Zenoh mesh, with the simulated person."""

import os
import re
import signal
import subprocess
import time
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from tests.support.demo_rigs import written_demo
from tests.support.networks import arguments_of, is_whole, listens, mesh, options_of, wait_for
from tests.support.processes import (
    PATIENCE_S,
    all_run,
    both_contribute,
    children_of,
    ended,
    last_line,
    messages_in,
    output_of,
    poses_in,
    recomputed_poses,
    run,
    shows,
    started,
    verified,
    wait_for_frames,
    wait_until,
)
from tests.support.session_rigs import START_S, SessionRig
from zenocap.common import messages as m
from zenocap.common.bus.protocol import Alive
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.rig.rig import demo_rig_file, load_rig
from zenocap.common.runtime.clock import RealClock
from zenocap.common.topics import TRACKER_POSE, UNIVERSAL_BAP
from zenocap.services.integrator.two_view.perspective import scaling_factor

pytestmark = pytest.mark.core


def test_the_demo_runs_and_writes_a_take(two_view_rig: SessionRig, two_view_take: Path) -> None:
    poses = poses_in(two_view_take)
    assert len(poses) > 20
    whole = [pose for pose in poses if set(pose.scores) == {"1", "2"} and not pose.stale]
    assert len(whole) > len(poses) / 2
    assert recomputed_poses(two_view_take) == len(poses)
    text = output_of(two_view_rig.folder)
    assert str(two_view_take) in text
    assert ", 0 lost" in text
    assert "first pose" in text
    assert "viewer 1: 1" in text  # frames per second
    assert "Traceback" not in text


@pytest.mark.nightly
def test_the_tracker_runs_beside_the_exchange_and_the_take_of_both_verifies(tmp_path: Path) -> None:
    with started(["demo"], tmp_path) as demo:
        both = r"integrator: [\d.]+/s tracking\b.* tracker: [\d.]+/s tracking\b"
        wait_until(lambda: shows(tmp_path, both) and all_run(tmp_path), tmp_path, START_S, [demo])
        wait_for_frames(tmp_path, 60)
        assert ended(demo, signal.SIGINT) == 0, output_of(tmp_path)
    (take,) = (tmp_path / "recordings").glob("demo-*.mcap")
    for topic, poses in ((UNIVERSAL_BAP, poses_in(take)), (TRACKER_POSE, messages_in(take, m.TrackerPose))):
        assert verified(take).equal[topic.at("demo")] == len(poses) > 20
    assert {bdp.viewer for bdp in messages_in(take, m.PartialBdp)} == {"1", "2"}
    assert [bdp.ratio for bdp in messages_in(take, m.UniversalBdp)] == [pytest.approx(1.0, abs=0.1)]
    cameras = {viewer.id: viewer.camera for viewer in load_rig(demo_rig_file("both")).viewers}
    assignments = [each for each in messages_in(take, m.Assignment) if each.tracking]
    assert assignments
    for one in assignments:
        assert {its.view for its in one.views.values()} == {"facade", "flank"}
        factors = {id: scaling_factor(camera, np.array(one.position)) for id, camera in cameras.items()}
        assert {id: its.scale for id, its in one.views.items()} == pytest.approx(factors)


@pytest.mark.nightly
@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="finds children in /proc")
def test_a_killed_viewer_is_restarted_and_contributes_again(tmp_path: Path) -> None:
    with started(["demo", "--method", "two-view"], tmp_path) as demo:
        wait_until(lambda: re.search(r"viewer 2: [\d.]+/s (flank|facade)", output_of(tmp_path)) is not None, tmp_path)
        victims = [pid for pid, line in children_of(demo.pid).items() if "viewer" in line and "--id 2" in line]
        assert len(victims) == 1
        os.kill(victims[0], signal.SIGKILL)
        wait_until(lambda: "viewer 2: started again" in output_of(tmp_path), tmp_path)
        wait_until(lambda: "without viewer 2" in output_of(tmp_path), tmp_path)
        wait_until(lambda: both_contribute(last_line(tmp_path)), tmp_path)
        children = children_of(demo.pid)
        assert ended(demo, signal.SIGINT) == 3, output_of(tmp_path)
    assert "not counted: what viewer 2 sent from" in output_of(tmp_path)
    assert not [pid for pid in children if Path(f"/proc/{pid}").exists()]
    (take,) = (tmp_path / "recordings").glob("demo-*.mcap")
    stale = [bool(pose.stale) for pose in poses_in(take)]
    assert True in stale
    assert not stale[-1]
    assert recomputed_poses(take) == len(stale)
    assert "died (SIGKILL); starting it again" in output_of(tmp_path)


@pytest.mark.nightly
@pytest.mark.parametrize(
    "order", [("integrator", "1", "2"), ("1", "integrator", "2"), ("2", "1", "integrator")], ids="-".join
)
def test_services_start_in_any_order(order: tuple[str, ...], tmp_path: Path) -> None:
    """Each service starts when the one before runs."""
    running: set[str] = set()
    places = dict(zip(("integrator", "1", "2", "here"), mesh(4), strict=True))
    rig, take = demo_rig_file("two-view"), tmp_path / "take.mcap"

    processes: list[subprocess.Popen[str]] = []
    with ZenohBus.open(options_of(places["here"]), "demo", RealClock()) as bus, ExitStack() as stack:
        bus.watch_alive()

        def runs(name: str) -> bool:
            match bus.receive(0.1):
                case Alive(service=service, id=id, alive=True):
                    running.add(service if id == "main" else id)
            return name in running or f"viewer {name}: waiting for viewer" in output_of(tmp_path)

        for name in order:
            role = ("integrator", rig, "-o", take) if name == "integrator" else ("viewer", rig, "--id", name)
            processes.append(stack.enter_context(started([*role, *arguments_of(places[name])], tmp_path)))
            wait_until(lambda name=name: runs(name), tmp_path)  # type: ignore[misc]
        bus.subscribe(UNIVERSAL_BAP)
        wait_for(bus, is_whole, 20)
        for process in processes:
            process.send_signal(signal.SIGTERM)
        assert [process.wait(PATIENCE_S) for process in processes] == [0, 0, 0], output_of(tmp_path)
    assert len(poses_in(take)) >= 20
    assert recomputed_poses(take) >= 20
    assert "Traceback" not in output_of(tmp_path)


@pytest.mark.nightly
def test_a_second_viewer_with_the_same_id_is_rejected(tmp_path: Path) -> None:
    place, other = mesh(2)
    arguments = ["viewer", demo_rig_file("two-view"), "--id", "1", "--epoch-ns", time.time_ns(), "--no-multicast-scouting"]
    with started([*arguments, "-l", place.listen], tmp_path) as one:
        wait_until(lambda: one.poll() is not None or listens(place.listen), tmp_path)
        with started([*arguments, "-l", other.listen, "-e", place.listen], tmp_path) as two:
            assert two.wait(PATIENCE_S) == 1
        assert "viewer 1 of rig demo is already running" in output_of(tmp_path)
        assert ended(one) == 0


@pytest.mark.nightly
def test_an_unreadable_video_ends_the_rig_with_the_reason(tmp_path: Path) -> None:
    rig = written_demo(tmp_path)
    (tmp_path / "cam.mp4").write_bytes(b"this is no video")
    head, mark, tail = rig.read_text().rpartition('source = "actor:demo?seed=4"')
    rig.write_text(head + 'source = "cam.mp4"' + tail)
    assert mark
    status, text = run(tmp_path, "up", rig, "--seconds", "60")
    assert status == 1
    assert "cam.mp4: not a video that can be decoded" in text
