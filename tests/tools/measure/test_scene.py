"""Scene of the load test."""

from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

from zenocap.common.bus.protocol import Envelope, Tick
from zenocap.common.camera.pinhole import angle_between_deg
from zenocap.common.messages import Phase
from zenocap.common.rig.rig import load_rig
from zenocap.common.rig.sources import BackgroundImage, Rendered
from zenocap.common.topics import SILHOUETTE
from zenocap.services.tracker.shell import tracker_service
from zenocap.tools.measure import scene
from zenocap.tools.measure.load_plan import Plan
from zenocap.tools.measure.recorded_messages import messages_file, read_messages, record_messages
from zenocap.tools.measure.scene import FILM_FPS, cameras, film, pictures, recording_rig_file, rig_files

SMALL = (32, 24)


def test_two_cameras_are_those_of_the_paper() -> None:
    one, two = cameras(2, SMALL)
    np.testing.assert_allclose(one.centre, [0.0, 1.0, 5.2], atol=1e-12)
    np.testing.assert_allclose(two.centre, [-5.2, 1.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("count", [2, 3, 4, 5, 8, 16, 32])
def test_all_cameras_see_the_middle_and_no_two_are_opposite(count: int) -> None:
    all_cameras = cameras(count, SMALL)
    for camera in all_cameras:
        np.testing.assert_allclose(camera.project(np.array([[0.0, 1.0, 0.0]]))[0], [15.5, 11.5], atol=1e-9)
        assert np.linalg.det(camera.rotation) == pytest.approx(1.0)
    axes = [camera.rotation[2] for camera in all_cameras]
    assert all(np.dot(a, b) > -0.9999 for a in axes for b in axes)
    assert len({camera.name for camera in all_cameras}) == count
    assert angle_between_deg(all_cameras[0], all_cameras[1]) > 1.0


def test_number_of_pictures_decreases_with_their_total_size() -> None:
    assert pictures(2, (160, 120)) == scene.LONGEST
    assert scene.SHORTEST <= pictures(32, (640, 480)) < scene.LONGEST
    assert pictures(64, (4096, 4096)) == scene.SHORTEST


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scene, "LONGEST", 3)
    monkeypatch.setattr(scene, "SHORTEST", 3)


@pytest.mark.usefixtures("short")
def test_a_plan_becomes_films_and_rigs_that_load(tmp_path: Path) -> None:
    plan = Plan(rigs=2, rate=25.0, size=SMALL, name="lab")
    seen: list[tuple[int, int]] = []
    film(tmp_path, plan, lambda done, of: seen.append((done, of)))
    assert seen == [(k, 6) for k in range(1, 7)]
    for path, name in zip(rig_files(tmp_path, plan), ("lab-1", "lab-2"), strict=True):
        rig = load_rig(path)
        assert (rig.name, rig.method, rig.person_height) == (name, "two-view", None)
        assert [viewer.id for viewer in rig.viewers] == ["1", "2"]
        for viewer in rig.viewers:
            assert viewer.fps == 25.0
            assert viewer.source == Rendered(tmp_path / f"cam0{viewer.id}.npy", FILM_FPS)
            assert isinstance(viewer.background, BackgroundImage)
    film(tmp_path, plan, lambda done, of: seen.append((0, 0)))
    assert len(seen) == 6  # already rendered


@pytest.mark.usefixtures("short")
def test_stand_ins_measure_no_body_but_the_recording_rig_does(tmp_path: Path) -> None:
    plan = Plan(size=SMALL, stand_ins=True)
    film(tmp_path, plan)
    assert load_rig(rig_files(tmp_path, plan)[0]).person_height is not None
    rehearsal = load_rig(recording_rig_file(tmp_path, plan))
    assert rehearsal.person_height is None
    assert {viewer.fps for viewer in rehearsal.viewers} == {FILM_FPS}


@pytest.mark.nightly
def test_a_track_starts_in_the_first_images_of_seven_large_views(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the person and the room before, no track ever started: `zenocap load` had no pose."""
    monkeypatch.setattr(scene, "LONGEST", 16)
    monkeypatch.setattr(scene, "SHORTEST", 16)
    plan = Plan(viewers=7, rate=30.0, size=(640, 480), method="hybrid", name="lab")
    film(tmp_path, plan)
    record_messages(recording_rig_file(tmp_path, plan))
    rig = load_rig(rig_files(tmp_path, plan)[0])
    service = tracker_service(rig)
    state = service.initial()
    films = {viewer.id: read_messages(messages_file(viewer)) for viewer in rig.viewers}
    for image in range(0, 16, 2):
        for viewer, each in films.items():
            seen = structs.replace(each[image].silhouette, frame=image, captured_ns=10**18 + round(image * 1e9 / FILM_FPS))
            envelope = Envelope(SILHOUETTE.at("lab-1", viewer=viewer), SILHOUETTE, seen, seen.captured_ns)
            state, _ = service.step(service.setup, state, envelope)
        state, _ = service.step(service.setup, state, Tick(10**18))
    assert service.phase(state) is Phase.TRACKING, service.describe(state)
