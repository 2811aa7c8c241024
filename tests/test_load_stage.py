"""What the load's viewers look at."""

from pathlib import Path

import numpy as np
import pytest

from common.camera.pairs import angle_between_deg
from common.runtime.rig import load_rig
from common.runtime.specs import BackgroundImage, Rendered
from services.load import stage
from services.load.plan import Plan
from services.load.stage import FILM_FPS, cameras, film, pictures, rehearsal_file, rig_files

SMALL = (32, 24)


def test_two_cameras_are_the_papers() -> None:
    one, two = cameras(2, SMALL)
    np.testing.assert_allclose(one.centre, [0.0, 1.0, 5.2], atol=1e-12)
    np.testing.assert_allclose(two.centre, [-5.2, 1.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("count", [2, 3, 4, 5, 8, 16, 32])
def test_all_cameras_see_the_middle_and_no_two_are_opposite(count: int) -> None:
    around = cameras(count, SMALL)
    for camera in around:
        np.testing.assert_allclose(camera.project(np.array([[0.0, 1.0, 0.0]]))[0], [15.5, 11.5], atol=1e-9)
        assert np.linalg.det(camera.rotation) == pytest.approx(1.0)
    axes = [camera.rotation[2] for camera in around]
    assert all(np.dot(a, b) > -0.9999 for a in axes for b in axes)
    assert len({camera.name for camera in around}) == count
    assert angle_between_deg(around[0], around[1]) > 1.0


def test_films_together_are_not_too_large() -> None:
    assert pictures(2, (160, 120)) == stage.LONGEST
    assert stage.SHORTEST <= pictures(32, (640, 480)) < stage.LONGEST
    assert pictures(64, (4096, 4096)) == stage.SHORTEST


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stage, "LONGEST", 3)
    monkeypatch.setattr(stage, "SHORTEST", 3)


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
    assert len(seen) == 6  # they are there


@pytest.mark.usefixtures("short")
def test_stand_ins_measure_no_body_but_the_rehearsal_does(tmp_path: Path) -> None:
    plan = Plan(size=SMALL, stand_ins=True)
    film(tmp_path, plan)
    assert load_rig(rig_files(tmp_path, plan)[0]).person_height is not None
    rehearsal = load_rig(rehearsal_file(tmp_path, plan))
    assert rehearsal.person_height is None
    assert {viewer.fps for viewer in rehearsal.viewers} == {FILM_FPS}
