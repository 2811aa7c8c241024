"""Outputs as a user runs them: animator and replay as processes, independent receivers."""

import json
import socket
from pathlib import Path

import numpy as np
import pytest

from tests.common.formats.test_take_poses import messages_of_track, write_take
from tests.services.animator.outputs.test_vmc import JOINTS, Marionette
from tests.support.demo_rigs import written_demo
from tests.support.networks import arguments_of, mesh
from tests.support.pose_tracks import moving
from tests.support.processes import PATIENCE_S, ended, output_of, started, wait_until
from zenocap.common.formats.take_poses import read_poses

pytestmark = pytest.mark.nightly

COUNT = 45  # fits into the buffer of a socket that is not read
OUTPUTS = """
[animator.page]
enabled = false

[animator.vmc]
port = {vmc}

[animator.vrchat]
port = {vrchat}
trackers = ["hip", "left_foot", "right_knee", "right_elbow"]

[animator.udp]
port = {udp}

[animator.foxglove]
port = {foxglove}
"""


def test_replay_reaches_every_receiver_and_a_failing_output_is_one_log_line(tmp_path: Path) -> None:
    take = write_take(tmp_path / "take.mcap", messages_of_track(moving(COUNT, rate=30.0)))
    centres = read_poses(take).trajectories()
    marionette, vrchat = Marionette(), Marionette()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listening, socket.socket() as taken:
        listening.bind(("127.0.0.1", 0))
        listening.setblocking(False)
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        ports = {
            "vmc": marionette.port, "vrchat": vrchat.port, "udp": listening.getsockname()[1],
            "foxglove": taken.getsockname()[1],
        }  # fmt: skip
        here, there = mesh(2)
        rig = written_demo(tmp_path, OUTPUTS.format(**ports), name="studio")
        with started(["animator", rig, *arguments_of(here)], tmp_path) as animator:
            wait_until(lambda: "animator.udp 127.0.0.1" in output_of(tmp_path), tmp_path)
            with started(["replay", take, "--delay", "2", *arguments_of(there)], tmp_path) as player:
                player.wait(PATIENCE_S)
            assert player.returncode == 0, output_of(tmp_path)
            assert ended(animator) == 0, output_of(tmp_path)
        lines = [json.loads(line) for line in drained(listening)]
    words = output_of(tmp_path)
    assert f"ERROR animator: animator.foxglove: 127.0.0.1:{ports['foxglove']} cannot be listened on" in words
    assert "Traceback" not in words

    numbers = [line["frame"] for line in lines]
    assert numbers == sorted(set(numbers))
    assert len(numbers) > 5  # of poses that arrive faster than they are sent, only the newest is sent
    for line in lines:
        row = int(np.flatnonzero(centres.frames == line["frame"])[0])
        np.testing.assert_allclose(list(line["joints"].values()), centres.points[row], atol=1e-4)

    marionette.listen()
    assert marionette.values["/VMC/Ext/OK"] == (0, 0, 0, 0)  # "not loaded": the animator has ended
    places = marionette.places()
    for joint, bone in JOINTS.items():
        np.testing.assert_allclose(places[bone] * [-1, 1, 1], lines[-1]["joints"][joint], atol=1e-3)
    marionette.close()

    vrchat.listen()
    for tracker, joint in {3: "LAnkle", 6: "RKnee", 8: "RElbow"}.items():
        place = np.array(vrchat.values[f"/tracking/trackers/{tracker}/position"])
        np.testing.assert_allclose(place * [-1, 1, 1], lines[-1]["joints"][joint], atol=1e-3)
    assert len(vrchat.values) == 2 * 4 + 1  # four trackers, and the place of the head
    vrchat.close()


def drained(listening: socket.socket) -> list[bytes]:
    found = []
    while True:
        try:
            found.append(listening.recv(65536))
        except BlockingIOError:
            return found
