"""The background of an earlier run: written while the viewer runs, taken up by the next one where it fits."""

import logging
from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.two_view_run import film, viewer_setup
from zenocap.common.rig.sources import AdaptiveBackground
from zenocap.common.vision.adaptive.saved import packed, read
from zenocap.services.viewer import silhouette_step
from zenocap.services.viewer.kept_background import BackgroundKeeper
from zenocap.services.viewer.parameters import KEEP_S
from zenocap.services.viewer.silhouette_step import Segmenting
from zenocap.services.viewer.states import Setup

SETUP = replace(viewer_setup("1"), background=AdaptiveBackground())
LOGGER = "zenocap.services.viewer.kept_background"


def played(setup: Setup, frames: int, keeper: BackgroundKeeper | None = None) -> silhouette_step.State:
    state = silhouette_step.initial_state(setup)
    for each in film(frames):
        state, _ = silhouette_step.step(setup, state, each["1"])
        if keeper is not None:
            keeper(state)
    return state


@pytest.fixture(scope="module")
def learnt() -> Segmenting:
    state = played(SETUP, 70)
    assert isinstance(state, Segmenting)
    return state


def test_the_model_is_written_every_minute_and_at_the_end(tmp_path: Path, learnt: Segmenting) -> None:
    path, now_s = tmp_path / "backgrounds" / "lab-1.npz", 0.0
    keeper = BackgroundKeeper(path, kept=False, clock=lambda: now_s)
    keeper(silhouette_step.initial_state(SETUP))
    keeper(learnt)
    now_s = KEEP_S - 1
    keeper(learnt)
    assert not path.exists()
    now_s = KEEP_S
    keeper(learnt)
    keeper.close()
    assert packed(read(path, SETUP.camera.size)) == packed(learnt.scene.background)  # type: ignore[arg-type]


def test_a_viewer_that_ends_while_it_learns_keeps_what_there_was(tmp_path: Path) -> None:
    path = tmp_path / "lab-1.npz"
    path.write_bytes(b"earlier")
    keeper = BackgroundKeeper(path, kept=True, clock=lambda: 0.0)
    played(SETUP, 5, keeper)
    keeper.close()
    assert path.read_bytes() == b"earlier"


def test_the_first_image_that_fits_ends_learning(
    learnt: Segmenting, caplog: pytest.LogCaptureFixture, tmp_path: Path
) -> None:
    caplog.set_level(logging.INFO, LOGGER)
    keeper = BackgroundKeeper(tmp_path / "lab-1.npz", kept=True, clock=lambda: 0.0)
    state = played(replace(SETUP, kept=learnt.scene.background), 2, keeper)  # type: ignore[arg-type]
    assert isinstance(state, Segmenting)
    assert state.scene.restored
    assert [record.getMessage() for record in caplog.records] == [f"background of {tmp_path / 'lab-1.npz'} taken up again"]


def test_a_model_that_never_fits_is_named_and_the_room_learnt_anew(
    learnt: Segmenting, caplog: pytest.LogCaptureFixture, tmp_path: Path
) -> None:
    model = learnt.scene.background
    other = replace(model, background=replace(model.background, mean=model.background.mean[::-1, ::-1].copy()))  # type: ignore
    keeper = BackgroundKeeper(tmp_path / "lab-1.npz", kept=True, clock=lambda: 0.0)
    state = played(replace(SETUP, kept=other), 70, keeper)
    assert isinstance(state, Segmenting)
    assert not state.scene.restored
    assert "does not fit: the camera was moved" in caplog.text


def test_a_folder_that_cannot_be_written_is_named_once(
    tmp_path: Path, learnt: Segmenting, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "file").write_text("")
    keeper = BackgroundKeeper(tmp_path / "file" / "lab-1.npz", kept=False, clock=lambda: 0.0)
    keeper(learnt)
    keeper.close()
    keeper.close()
    assert caplog.text.count("the background is not kept") == 1
