"""ROS 2 output as a user runs it: replay, animator, router, example 11."""

import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.common.formats.test_take_poses import messages_of_track, write_take
from tests.support.demo_rigs import written_demo
from tests.support.networks import arguments_of, free_endpoint, mesh
from tests.support.places import ROOT
from tests.support.pose_tracks import moving
from tests.support.processes import PATIENCE_S, ended, output_of, started, wait_until
from tests.support.ros_listener import RosListener
from zenocap.common.formats.rmw_zenoh import MARKER_ARRAY, TF_MESSAGE
from zenocap.common.formats.take_poses import read_poses
from zenocap.common.formats.trajectories import convert

pytestmark = pytest.mark.nightly
OUTPUT = '\n[animator.page]\nenabled = false\n\n[animator.ros]\nconnect = "{endpoint}"\n'


def test_a_replayed_take_reaches_a_node_of_ros_through_zenocaps_router(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    rig = written_demo(tmp_path, OUTPUT.format(endpoint=endpoint), name="studio")
    take = write_take(tmp_path / "take.mcap", messages_of_track(moving(60, rate=30.0)))
    centres = read_poses(take).trajectories()
    heads = convert(centres.points[:, centres.names.index("Head")], "ros")
    here, there = mesh(2)
    (example,) = (ROOT / "examples").glob("11_*.py")
    with (
        started(["router", "-l", endpoint, "--no-multicast-scouting"], tmp_path),
        started(["animator", rig, *arguments_of(here)], tmp_path) as animator,
    ):
        wait_until(lambda: "ROS: connected as node /studio/zenocap" in output_of(tmp_path), tmp_path)
        listener = RosListener(endpoint, 0)
        reader = subprocess.Popen(
            [sys.executable, example, endpoint, "studio"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        try:
            assert len(listener.tokens(0, 3)) == 3
            with started(["replay", take, "--loop", "--delay", "3", *arguments_of(there)], tmp_path) as player:
                messages = [one.message for one in listener.received(TF_MESSAGE.name, 30)]
                figures = listener.received(MARKER_ARRAY.name, 30, lambda message: bool(message.markers[0].points))
                line = reader.stdout.readline()
                assert ended(player, signal.SIGINT) == 0, output_of(tmp_path)
            assert ended(animator) == 0, output_of(tmp_path)
            listener.received(MARKER_ARRAY.name, 1, lambda message: not message.markers[0].points)  # the figure is removed
            assert listener.tokens(0, 0) == set()
        finally:
            reader.terminate()
            reader.wait(PATIENCE_S)
            listener.close()
    assert "Traceback" not in output_of(tmp_path)
    assert line.startswith("head in map: [")
    assert all(len(message.transforms) == 10 for message in messages)
    index = centres.names.index("Head")
    for figure in figures:
        place = figure.message.markers[1].points[index]
        distances = np.linalg.norm(heads - [place.x, place.y, place.z], axis=1)
        assert distances.min() < 1e-3
