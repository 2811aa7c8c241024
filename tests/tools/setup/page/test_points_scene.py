"""Points of a room on the page: cameras are solved as they are placed, and nothing wrong is written."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.room_pictures import ROOM, room_camera
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.camera.lens import Lens
from zenocap.common.errors import UserError
from zenocap.tools.setup.calibration.scene_file import read_scene
from zenocap.tools.setup.page.points_scene import ScenePointTask
from zenocap.tools.setup.page.points_task import Placed

NAMES = ("cam01", "cam02")
CAMERAS = {"cam01": room_camera("cam01", 0.3), "cam02": room_camera("cam02", -1.2)}
LENSES = {name: Lens.of(camera) for name, camera in CAMERAS.items()}
SIZES = {name: camera.size for name, camera in CAMERAS.items()}


def pixels_of(name: str) -> dict[str, tuple[float, float]]:
    return {key: tuple(CAMERAS[name].project(np.array([place]))[0].tolist()) for key, place in ROOM.items()}


def placed() -> Placed:
    return Placed(dict(ROOM), {}, {name: pixels_of(name) for name in NAMES}, SIZES, SIZES)


@pytest.fixture
def task(tmp_path) -> ScenePointTask:
    return ScenePointTask(NAMES, tmp_path / "points.toml", tmp_path / "room.toml", LENSES)


def test_placed_points_give_the_cameras_and_both_files(task, tmp_path):
    solution = task.solve(placed())
    assert (solution.verdict, solution.sentence) == ("good", "Good: press Save.")
    assert all(max(view.off_px.values()) < 0.01 and not view.problem for view in solution.views)
    assert task.write(placed(), solution) == [str(tmp_path / "points.toml"), str(tmp_path / "room.toml")]
    for name, camera in read_calibration(tmp_path / "room.toml").items():
        assert camera.centre == pytest.approx(CAMERAS[name].centre, abs=1e-3)
    scene = read_scene(tmp_path / "points.toml")
    assert (scene.points, set(scene.picked)) == (ROOM, set(NAMES))
    again = ScenePointTask(NAMES, tmp_path / "points.toml", tmp_path / "room.toml", LENSES).start()
    assert again.points == ROOM
    assert again.picks["cam02"]["lamp"] == pytest.approx(pixels_of("cam02")["lamp"], abs=0.01)
    nowhere = ScenePointTask(NAMES, tmp_path / "none" / "points.toml", tmp_path / "room.toml", LENSES)
    with pytest.raises(UserError, match=r"points\.toml.*: cannot be written: No such file"):
        nowhere.write(placed(), solution)


def test_the_sentence_asks_for_points_then_for_their_places_in_pictures(task):
    few = Placed({"door": ROOM["door"], "lamp": (None, 1.0, 0.0)}, {}, {}, SIZES)
    assert task.solve(few).sentence.startswith("Add 4 or more points of the room, and type where they are: 1 so far")
    unplaced = Placed(dict(ROOM), {}, {"cam01": pixels_of("cam01"), "cam02": {}}, SIZES, SIZES)
    solution = task.solve(unplaced)
    assert solution.sentence == "Place 4 more points in the picture of cam02: click where each is."
    assert (solution.verdict, list(solution.cameras)) == ("", ["cam01"])


@pytest.mark.slow
def test_a_point_that_contradicts_is_named_and_the_verdict_poor(task):
    picks = pixels_of("cam01")
    picks["shelf"] = (picks["shelf"][0] + 30.0, picks["shelf"][1] + 30.0)
    solution = task.solve(replace(placed(), picks={"cam01": picks, "cam02": pixels_of("cam02")}))
    assert solution.verdict == "poor"
    assert [view.suspect for view in solution.views] == ["shelf", ""]
    assert "shelf" in solution.sentence


def test_where_points_are_expected_is_shown_for_those_that_were_not_placed(task):
    picks = {name: pixel for name, pixel in pixels_of("cam01").items() if name != "pole"}
    view = task.solve(replace(placed(), picks={"cam01": picks, "cam02": pixels_of("cam02")})).views[0]
    assert "pole" not in view.off_px
    assert view.expected["pole"] == pytest.approx(pixels_of("cam01")["pole"], abs=0.05)


def test_points_without_coordinates_and_unsolved_cameras_are_not_written(task, tmp_path):
    open_point = replace(placed(), points={**ROOM, "new": (1.0, None, 0.0)})
    with pytest.raises(UserError, match="not yet: new: coordinates are missing: type them, or remove the point"):
        task.write(open_point, task.solve(open_point))
    half = replace(placed(), picks={"cam01": pixels_of("cam01"), "cam02": {}})
    with pytest.raises(UserError, match=r"not yet: .*cam02"):
        task.write(half, task.solve(half))
    other = replace(placed(), sizes={**SIZES, "cam02": (1280, 720)})
    with pytest.raises(UserError, match="cam02: its picture has 1280 x 720 px, its points were placed in 640 x 480"):
        task.write(other, task.solve(other))
    unseen = Placed(dict(ROOM), {}, {"cam01": pixels_of("cam01")}, {"cam01": SIZES["cam01"]}, {"cam01": SIZES["cam01"]})
    assert task.solve(unseen).views[1].problem == "cam02: no picture yet"
    assert list(tmp_path.iterdir()) == []


def test_points_of_other_cameras_in_the_file_stay(task, tmp_path):
    task.write(placed(), task.solve(placed()))
    one = ScenePointTask(["cam01"], tmp_path / "points.toml", tmp_path / "one.toml", LENSES)
    alone = replace(one.start(), sizes={"cam01": SIZES["cam01"]})
    one.write(alone, one.solve(alone))
    assert set(read_scene(tmp_path / "points.toml").picked) == set(NAMES)
    assert list(read_calibration(tmp_path / "one.toml")) == ["cam01"]


def test_reserved_names_and_files_of_other_cameras_are_refused(tmp_path, task):
    for name in ("size", "points"):
        with pytest.raises(UserError, match=f"camera {name}: allowed: any name but size and points"):
            ScenePointTask([name], tmp_path / "points.toml", tmp_path / "room.toml")
    task.write(placed(), task.solve(placed()))
    with pytest.raises(UserError, match="no points of cam07; there are those of: cam01, cam02"):
        ScenePointTask(["cam07"], tmp_path / "points.toml", tmp_path / "room.toml")


@pytest.mark.parametrize("name", ["\U0001f600", 'a "b" \\ c', "constructor"])
def test_a_file_without_sizes_is_saved_and_names_of_points_are_read_again(name, task, tmp_path):
    named = {name if key == "lamp" else key: place for key, place in ROOM.items()}
    picks = {camera: {name if key == "lamp" else key: at for key, at in pixels_of(camera).items()} for camera in NAMES}
    unchanged = Placed(named, {}, picks, SIZES, {})
    task.write(unchanged, task.solve(unchanged))
    scene = read_scene(tmp_path / "points.toml")
    assert (scene.points, scene.size) == (named, SIZES["cam01"])


def test_a_calibration_that_another_program_has_made_stays(task, tmp_path):
    (tmp_path / "room.toml").write_text("mine")
    solution = task.solve(placed())
    with pytest.raises(UserError, match=r"room\.toml: exists since a moment ago"):
        task.write(placed(), solution)
    assert (tmp_path / "room.toml").read_text() == "mine"
    (tmp_path / "room.toml").unlink()
    for _ in range(2):  # its own is replaced
        task.write(placed(), solution)
