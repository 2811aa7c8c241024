"""Setup of the steps in a take: round trip, parameters, prior, errors."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from zenocap.common.errors import UserError
from zenocap.common.recording.opening import attachments
from zenocap.common.recording.setup_file import (
    PARAMETERS_FILE,
    PRIOR_FILE,
    SETUP_FILE,
    checked_attachment,
    read_parameters,
    read_setup,
    recorded_rig,
    write_parameters,
    write_setup,
)
from zenocap.common.rig.rig import Rig, demo_rig
from zenocap.common.rig.sources import MedianFrames, VideoFile, learning_frames
from zenocap.common.rig.tracker import PRESETS, FilterOptions, TrackerSpec

TAKE = Path("monday.mcap")


def test_a_setup_round_trips_exactly() -> None:
    rig = recorded_rig(demo_rig("two-view"))
    again = read_setup(TAKE, write_setup(rig))
    assert again == rig
    for viewer in demo_rig("two-view").viewers:
        camera = again.cameras()[viewer.id]
        assert camera.size == viewer.camera.size
        for name in ("matrix", "distortions", "rotation", "translation"):
            np.testing.assert_array_equal(getattr(camera, name), getattr(viewer.camera, name))


def test_the_median_of_a_video_counts_as_a_background_image() -> None:
    viewer = replace(demo_rig("two-view").viewers[0], source=VideoFile(Path("a.mp4")), background=MedianFrames())
    assert learning_frames(viewer.background) == 60
    assert learning_frames(viewer.background_in_use) == 5


@pytest.mark.parametrize(
    ("old_text", "new_text"),
    [
        (b'"fps": 15.0', b'"fps": 0'),
        (b'"fps": 15.0', b'"fps": 1e-300'),  # its period was infinite
        (b'"fps": 15.0', b'"fps": "fast"'),
        (b'"matrix": [', b'"matrix": [1, '),
        (b'"size": [', b'"size": [0, '),
        (b'"name": "demo"', b'"name": "a/b"'),
        (b'"viewers": [', b'"others": ['),
    ],
)
def test_a_bad_setup_names_the_take_and_the_field(old_text: bytes, new_text: bytes) -> None:
    data = write_setup(recorded_rig(demo_rig("two-view")))
    assert old_text in data
    with pytest.raises(UserError, match=r"monday\.mcap: attachment setup\.json: "):
        read_setup(TAKE, data.replace(old_text, new_text, 1))


def test_a_setup_without_viewers_is_refused() -> None:
    data = write_setup(msgspec.structs.replace(recorded_rig(demo_rig("two-view")), viewers=[]))
    with pytest.raises(UserError, match="viewers: allowed: one or more"):
        read_setup(TAKE, data)


def hybrid(prior: Path | None = None, options: FilterOptions | None = None) -> Rig:
    spec = TrackerSpec(prior, 40, 400, 4, 7, "fourteen-parts", "gauss-newton", filter=options or FilterOptions())
    return replace(demo_rig("two-view"), method="hybrid", tracker=spec)


def attached(rig: Rig, parameters: Mapping[str, Mapping[str, object]] | None = None) -> dict[str, bytes]:
    return {attachment.name: attachment.data for attachment in attachments(rig, parameters or {})}


def test_a_trackers_setup_round_trips_and_its_prior_is_attached(tmp_path: Path) -> None:
    content = b"content of a prior"
    (tmp_path / "walk.prior").write_bytes(content)
    files = attached(hybrid(tmp_path / "walk.prior"))
    assert files[PRIOR_FILE] == content
    tracker = read_setup(TAKE, files[SETUP_FILE]).tracker
    assert tracker.prior_sha256 == hashlib.sha256(content).hexdigest()
    assert (tracker.particles, tracker.seed, tracker.anatomy) == (40, 7, "fourteen-parts")


@pytest.mark.parametrize("prior", [None, Path("on-another-machine.prior")])
def test_no_prior_is_attached_for_a_rig_without_a_prior_file(prior: Path | None) -> None:
    files = attached(hybrid(prior))
    assert PRIOR_FILE not in files
    assert read_setup(TAKE, files[SETUP_FILE]).tracker.prior_sha256 is None


def test_an_attachment_is_that_of_the_setup_and_none_where_the_setup_has_none() -> None:
    content = b"content of a prior"
    digest = hashlib.sha256(content).hexdigest()
    assert checked_attachment(TAKE, PRIOR_FILE, content, digest) == content
    assert checked_attachment(TAKE, PRIOR_FILE, content, None) is None
    with pytest.raises(UserError, match=r"monday\.mcap: attachment tracker\.prior is missing"):
        checked_attachment(TAKE, PRIOR_FILE, None, digest)
    with pytest.raises(ValueError, match=rf"tracker\.prior: sha256 = [0-9a-f]{{12}}\.\.\.: allowed: {digest[:12]}"):
        checked_attachment(TAKE, PRIOR_FILE, b"another", digest)


def test_a_setup_of_an_unknown_anatomy_is_refused_where_the_anatomy_is_needed() -> None:
    recorded = recorded_rig(hybrid())
    assert recorded.anatomy().name == "fourteen-parts"
    other = msgspec.structs.replace(recorded, tracker=msgspec.structs.replace(recorded.tracker, anatomy="six-parts"))
    with pytest.raises(ValueError, match=r"tracker\.anatomy = 'six-parts': allowed: ten-parts, fourteen-parts"):
        other.anatomy()


def test_the_options_of_a_preset_are_recorded_and_a_setup_without_them_is_the_default() -> None:
    data = write_setup(recorded_rig(hybrid(options=PRESETS["paper"].filter)))
    assert read_setup(TAKE, data).tracker.filter == PRESETS["paper"].filter
    plain = json.loads(data)
    del plain["tracker"]["filter"]
    assert read_setup(TAKE, json.dumps(plain).encode()).tracker.filter == FilterOptions()


def test_a_setup_of_a_version_without_tracker_is_read() -> None:
    data = write_setup(recorded_rig(demo_rig("two-view")))
    assert b'"tracker": null' in data
    old = data.replace(b',\n "tracker": null', b"")
    assert old != data
    assert read_setup(TAKE, old) == recorded_rig(demo_rig("two-view"))


def test_parameters_round_trip_and_equal_ones_give_equal_bytes() -> None:
    one = {"viewer": {"B": (1, 2.5), "A": True}, "integrator": {"C": "x"}}
    other = {"integrator": {"C": "x"}, "viewer": {"A": True, "B": [1, 2.5]}}
    assert write_parameters(one) == write_parameters(other)
    assert read_parameters(TAKE, write_parameters(one)) == other


def test_parameters_are_attached_unless_there_are_none() -> None:
    files = attached(demo_rig("two-view"), {"viewer": {"A": 1}})
    assert read_parameters(TAKE, files[PARAMETERS_FILE]) == {"viewer": {"A": 1}}
    assert PARAMETERS_FILE not in attached(demo_rig("two-view"))


@pytest.mark.parametrize("data", [b"{", b"[]", b'{"viewer": 1}'])
def test_damaged_parameters_raise_an_error_that_names_the_take(data: bytes) -> None:
    with pytest.raises(UserError, match=r"attachment parameters\.json"):
        read_parameters(TAKE, data)
