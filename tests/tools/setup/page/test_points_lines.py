"""The paper's calibration on the page: three objects in two pictures."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.simulated_cameras import paper_cameras
from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.errors import UserError
from zenocap.tools.setup.page.points_lines import FIELDS, LinePoints
from zenocap.tools.setup.page.points_task import Placed

CAMERAS = {camera.name: camera for camera in paper_cameras()}
NAMES = tuple(CAMERAS)
TOPS = {"A": (0.0, 1.7, 0.0), "B": (0.0, 1.7, 1.0), "C": (1.0, 1.7, 0.0)}
MEASURED = {"d_x": 1.0, "d_z": 1.0, "t": 1.7, "distance1": 5.2, "distance2": 5.2, "height1": 1.0, "height2": 1.0}
SIZES = {name: camera.size for name, camera in CAMERAS.items()}


@pytest.fixture
def task(tmp_path) -> LinePoints:
    return LinePoints(NAMES, tmp_path / "lines.toml", tmp_path / "room.toml")


def placed(task: LinePoints, **fields: float | None) -> Placed:
    picks = {
        name: {key: tuple(camera.project(np.array([top]))[0].tolist()) for key, top in TOPS.items()}
        for name, camera in CAMERAS.items()
    }
    return task.completed(Placed({}, {**MEASURED, **fields}, picks, SIZES, SIZES))


def test_the_objects_are_where_the_measures_put_them(task):
    measured = placed(task, d_x=1.2, d_z=0.8, t=1.5)
    assert measured.points == {"A": (0.0, 1.5, 0.0), "B": (0.0, 1.5, 0.8), "C": (1.2, 1.5, 0.0)}
    assert [row.key for row in task.fields(task.start())] == [key for key, _, _ in FIELDS]
    assert [row.key for row in task.fields(task.start()) if row.needed] == ["d_x", "d_z", "t"]


def test_true_picks_give_the_cameras_and_the_file_is_read_again(task, tmp_path):
    solution = task.solve(placed(task))
    assert (solution.verdict, solution.sentence) == ("good", "Good: press Save.")
    task.write(placed(task), solution)
    for name, camera in read_calibration(tmp_path / "room.toml").items():
        assert camera.centre == pytest.approx(CAMERAS[name].centre, abs=0.01)
    again = LinePoints(NAMES, tmp_path / "lines.toml", tmp_path / "room.toml").start()
    assert again.fields == MEASURED
    assert again.picks["cam02"]["C"] == pytest.approx(placed(task).picks["cam02"]["C"], abs=0.01)
    nowhere = LinePoints(NAMES, tmp_path / "none" / "lines.toml", tmp_path / "room.toml")
    with pytest.raises(UserError, match=r"lines\.toml.*: cannot be written: No such file"):
        nowhere.write(placed(task), solution)


def test_without_distances_nothing_checks_the_result(task):
    solution = task.solve(placed(task, distance1=None, distance2=None, height1=None, height2=None))
    assert solution.verdict in ("unchecked", "poor")
    assert solution.sentence == f"{solution.reasons[0]}."


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"fields": {**MEASURED, "d_z": None, "t": None}}, "type the B on the Z axis, the height of the objects"),
        ({"picks": {"cam01": {"A": (80.0, 60.0)}, "cam02": {}}}, "cam01: place B, C: the tops of the objects at A, B"),
        ({"sizes": {**SIZES, "cam01": (320, 240)}}, "cam01: its picture has 320 x 240 px, its points were placed in"),
        ({"sizes": {**SIZES, "cam02": (32, 24)}, "picked_sizes": {}}, " and 32 x 24 px: allowed: equal sizes"),
    ],
)
def test_what_is_missing_or_contradicts_is_named_and_not_written(task, tmp_path, change, message):
    wrong = replace(placed(task), **change)
    solution = task.solve(wrong)
    assert solution.verdict == ""
    assert message in solution.sentence
    with pytest.raises(UserError) as error:
        task.write(wrong, solution)
    assert str(error.value).startswith("not yet: ")
    assert message in str(error.value)
    assert list(tmp_path.iterdir()) == []


def test_wrong_measures_are_refused_with_their_range(task):
    for fields in ({"t": -1.0}, {"d_x": 0.0}):
        solution = task.solve(placed(task, **fields))
        assert solution.verdict == ""
        assert "allowed" in solution.views[0].problem


def test_other_numbers_of_cameras_are_refused(tmp_path):
    for names in (("cam01",), ("cam01", "cam02", "cam03")):
        with pytest.raises(UserError, match=f"{len(names)} cameras: allowed: two, camera 1 on"):
            LinePoints(names, tmp_path / "lines.toml", tmp_path / "room.toml")


def test_a_calibration_that_another_program_has_made_stays(task, tmp_path):
    (tmp_path / "room.toml").write_text("mine")
    solution = task.solve(placed(task))
    with pytest.raises(UserError, match=r"room\.toml: exists since a moment ago"):
        task.write(placed(task), solution)
    assert (tmp_path / "room.toml").read_text() == "mine"
    (tmp_path / "room.toml").unlink()
    for _ in range(2):  # its own is replaced
        task.write(placed(task), solution)
