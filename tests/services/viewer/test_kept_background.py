"""Background of an earlier run: written, taken up where it fits."""

import logging
from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.two_view_run import film, viewer_setup
from zenocap.common.rig.rig import Rig, demo_rig
from zenocap.common.rig.sources import AdaptiveBackground, Device, Source, Stream
from zenocap.common.rig.viewers import Viewer
from zenocap.common.vision.adaptive.saved import Owner, packed, read, write
from zenocap.services.viewer import step as silhouette_step
from zenocap.services.viewer.kept_background import BackgroundKeeper, kept_path, owner_of, read_kept
from zenocap.services.viewer.parameters import KEEP_S
from zenocap.services.viewer.states import ViewerSetup
from zenocap.services.viewer.step import Segmenting

SETUP = replace(viewer_setup("1"), background=AdaptiveBackground())
CAMERA = Device(0)
OWNER = Owner("lab", "1", "4f")
LOGGER = "zenocap.services.viewer.kept_background"


def played(setup: ViewerSetup, frames: int, keeper: BackgroundKeeper | None = None) -> silhouette_step.SilhouetteState:
    state = silhouette_step.initial_state(setup)
    for each in film(frames):
        state, _ = silhouette_step.step(setup, state, each["1"])
        if keeper is not None:
            keeper(state)
    return state


@pytest.fixture(scope="module")
def learnt() -> Segmenting:
    return played(SETUP, 70)


@pytest.mark.slow
def test_the_model_is_written_every_minute_and_at_the_end(tmp_path: Path, learnt: Segmenting) -> None:
    path, now_s = tmp_path / "backgrounds" / "lab-1.npz", 0.0
    keeper = BackgroundKeeper(path, OWNER, kept=False, clock=lambda: now_s)
    keeper(silhouette_step.initial_state(SETUP))
    keeper(learnt)
    now_s = KEEP_S - 1
    keeper(learnt)
    assert not path.exists()
    now_s = KEEP_S
    keeper(learnt)
    keeper.close()
    back = read(path, SETUP.camera.size, OWNER)
    assert packed(back, OWNER) == packed(learnt.scene.background, OWNER)


def test_a_viewer_that_ends_while_it_learns_keeps_what_there_was(tmp_path: Path) -> None:
    path = tmp_path / "lab-1.npz"
    path.write_bytes(b"earlier")
    keeper = BackgroundKeeper(path, OWNER, kept=True, clock=lambda: 0.0)
    played(SETUP, 5, keeper)
    keeper.close()
    assert path.read_bytes() == b"earlier"


def test_the_first_image_that_fits_ends_learning(learnt, caplog, tmp_path):
    caplog.set_level(logging.INFO, LOGGER)
    keeper = BackgroundKeeper(tmp_path / "lab-1.npz", OWNER, kept=True, clock=lambda: 0.0)
    assert played(replace(SETUP, kept=learnt.scene.background), 2, keeper).scene.restored
    assert [record.getMessage() for record in caplog.records] == [f"background of {tmp_path / 'lab-1.npz'} taken up again"]


@pytest.mark.nightly
def test_a_model_that_never_fits_is_named_and_the_room_learnt_anew(learnt, caplog, tmp_path):
    model = learnt.scene.background
    other = replace(model, background=replace(model.background, mean=model.background.mean[::-1, ::-1].copy()))
    keeper = BackgroundKeeper(tmp_path / "lab-1.npz", OWNER, kept=True, clock=lambda: 0.0)
    assert not played(replace(SETUP, kept=other), 70, keeper).scene.restored
    assert "does not fit: the camera was moved" in caplog.text


def test_a_folder_that_cannot_be_written_is_named_once(learnt, caplog, tmp_path):
    (tmp_path / "file").write_text("")
    keeper = BackgroundKeeper(tmp_path / "file" / "lab-1.npz", OWNER, kept=False, clock=lambda: 0.0)
    keeper(learnt)
    keeper.close()
    keeper.close()
    assert caplog.text.count("the background is not kept") == 1


def placed(folder: Path, rig: str, viewer: str, source: Source = CAMERA) -> tuple[Rig, Viewer]:
    camera = SETUP.camera
    one = Viewer(viewer, camera, camera.size, source, AdaptiveBackground(), 30.0, False, True, keep_background=True)
    return replace(demo_rig(), name=rig, base=folder, viewers=(one,)), one


def test_two_viewers_never_have_the_same_file(tmp_path: Path) -> None:
    names = ["lab 1", "lab-1 2", "lab 1-2", "lab.1 2", "lab 1.2", "lab-1-2 3", "lab-1 2-3"]  # of rig and viewer
    assert len({kept_path(*placed(tmp_path, *each.split())) for each in names}) == len(names)


def test_the_background_of_another_source_is_refused_and_a_new_password_is_not(learnt, caplog, tmp_path):
    first = placed(tmp_path, "lab", "1", Stream("rtsp://anna:one@10.0.0.1/stream"))
    write(kept_path(*first), packed(learnt.scene.background, owner_of(*first)))
    assert read_kept(*first) is not None
    assert read_kept(*placed(tmp_path, "lab", "1", Stream("rtsp://10.0.0.1/stream"))) is not None
    assert not caplog.records
    for other in (Stream("rtsp://10.0.0.2/stream"), CAMERA):
        assert read_kept(*placed(tmp_path, "lab", "1", other)) is None
    assert caplog.text.count("viewer '1' had another source") == 2


def test_a_file_with_the_ambiguous_name_of_earlier_versions_is_named(tmp_path, caplog):
    old = tmp_path / "backgrounds" / "lab-1.npz"
    old.parent.mkdir()
    old.write_bytes(b"earlier")
    assert read_kept(*placed(tmp_path, "lab", "1")) is None
    assert f"{old}: of an earlier version" in caplog.text
    assert "kept in lab+1.npz" in caplog.text
