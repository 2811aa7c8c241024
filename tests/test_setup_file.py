"""What a take says of the setup of its steps."""

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from common.runtime.rig import Rig, demo_rig
from common.runtime.specs import MedianFrames, VideoFile, learning_frames
from common.runtime.tracker_table import TrackerSpec
from common.take.opening import attachments
from common.take.reading import TakeError
from common.take.setup import PRIOR_FILE, SETUP_FILE, read_setup, recorded_rig, write_setup

TAKE = Path("monday.mcap")


def test_a_setup_is_read_back_to_the_last_digit() -> None:
    rig = recorded_rig(demo_rig())
    again = read_setup(TAKE, write_setup(rig))
    assert again == rig
    for viewer in demo_rig().viewers:
        camera = again.cameras()[viewer.id]
        assert camera.size == viewer.camera.size
        for name in ("matrix", "distortions", "rotation", "translation"):
            np.testing.assert_array_equal(getattr(camera, name), getattr(viewer.camera, name))


def test_the_median_of_a_video_is_learnt_as_a_plate() -> None:
    viewer = replace(demo_rig().viewers[0], source=VideoFile(Path("a.mp4")), background=MedianFrames())
    assert learning_frames(viewer.background) == 60
    assert learning_frames(viewer.background_in_use) == 5


@pytest.mark.parametrize(
    ("was", "becomes"),
    [
        (b'"fps": 15.0', b'"fps": 0'),
        (b'"fps": 15.0', b'"fps": "fast"'),
        (b'"matrix": [', b'"matrix": [1, '),
        (b'"size": [', b'"size": [0, '),
        (b'"name": "demo"', b'"name": "a/b"'),
        (b'"viewers": [', b'"others": ['),
    ],
)
def test_a_bad_setup_names_the_take_and_the_field(was: bytes, becomes: bytes) -> None:
    data = write_setup(recorded_rig(demo_rig()))
    assert was in data
    with pytest.raises(TakeError, match=r"monday\.mcap: attachment setup\.json: "):
        read_setup(TAKE, data.replace(was, becomes, 1))


def test_a_setup_without_viewers_is_refused() -> None:
    data = write_setup(replace_viewers())
    with pytest.raises(TakeError, match="viewers: allowed: one or more"):
        read_setup(TAKE, data)


def replace_viewers() -> object:
    import msgspec

    return msgspec.structs.replace(recorded_rig(demo_rig()), viewers=[])


def hybrid(prior: Path | None) -> Rig:
    spec = TrackerSpec(prior, 40, 400, 4, 7, "fourteen-parts", "gauss-newton")
    return replace(demo_rig(), method="hybrid", tracker=spec)


def test_a_trackers_setup_is_read_back_and_its_prior_lies_beside_it(tmp_path: Path) -> None:
    content = b"what was learnt"
    (tmp_path / "walk.prior").write_bytes(content)
    rig = hybrid(tmp_path / "walk.prior")
    files = {attachment.name: attachment.data for attachment in attachments(rig)}
    assert files[PRIOR_FILE] == content
    tracker = read_setup(TAKE, files[SETUP_FILE]).tracker
    assert tracker is not None
    assert tracker.prior_sha256 == hashlib.sha256(content).hexdigest()
    assert (tracker.particles, tracker.seed, tracker.anatomy) == (40, 7, "fourteen-parts")


@pytest.mark.parametrize("prior", [None, Path("on-another-machine.prior")])
def test_without_a_prior_none_is_attached(prior: Path | None) -> None:
    files = {attachment.name: attachment.data for attachment in attachments(hybrid(prior))}
    assert PRIOR_FILE not in files
    tracker = read_setup(TAKE, files[SETUP_FILE]).tracker
    assert tracker is not None
    assert tracker.prior_sha256 is None


def test_a_setup_of_a_version_without_tracker_is_read() -> None:
    data = write_setup(recorded_rig(demo_rig()))
    assert b'"tracker": null' in data
    old = data.replace(b',\n "tracker": null', b"")
    assert old != data
    assert read_setup(TAKE, old) == recorded_rig(demo_rig())
