"""The page of points: what it publishes, what it saves, and the commands that it refuses."""

from contextlib import closing

import msgspec
import pytest

from tests.support.live_cameras import at_once, camera_of, picture, running, until
from zenocap.common.errors import UserError
from zenocap.tools.setup.page import messages as lm
from zenocap.tools.setup.page import point_messages as pm
from zenocap.tools.setup.page.points_mode import PointsMode
from zenocap.tools.setup.page.points_task import Placed, Solution, refused

pytestmark = pytest.mark.slow


class Task:
    """A task that is solved once every point has a place in the picture of the only camera."""

    name: pm.PointTask = "scene"
    centre_lines = False

    def __init__(self, editable: bool = True, failure: Exception | None = None) -> None:
        self.editable, self.failure = editable, failure
        self.saved: list[Placed] = []

    def start(self) -> Placed:
        return Placed({"door": (1.0, 0.0, 0.0)}, {"t": None})

    def completed(self, placed: Placed) -> Placed:
        return placed

    def fields(self, placed: Placed) -> list[pm.FieldRow]:
        return [pm.FieldRow("t", "height", "m", placed.fields["t"], True)]

    def solve(self, placed: Placed) -> Solution:
        if self.failure is not None:
            raise self.failure
        if set(placed.picks.get("cam01", {})) == set(placed.points):
            return Solution([], "good", [], {}, [], "solved")
        return Solution([], "", ["place all"], {}, [], "place all")

    def write(self, placed: Placed, solution: Solution) -> list[str]:
        if solution.verdict != "good":
            raise refused(solution.reasons)
        self.saved.append(placed)
        return ["room.toml"]


@pytest.fixture
def page(request):
    """The mode of a task (default: editable), whose camera has given a picture."""
    task = getattr(request, "param", Task)()
    camera = camera_of(lambda: at_once(picture, 1), "cam01")
    with running(camera), closing(PointsMode([camera], task)) as mode:
        until(lambda: camera.newest is not None, "an image")
        yield mode, task


def update_of(mode) -> dict:
    mode.tick()
    return msgspec.json.decode(msgspec.json.encode(mode._update()))


def test_picks_are_solved_saved_and_the_end_is_offered(page):
    mode, task = page
    mode.tick()
    with pytest.raises(UserError, match="not yet: place all"):
        mode.receive(pm.Save())
    mode.receive(pm.Pick("cam01", "door", (5.0, 6.0)))
    until(lambda: update_of(mode)["verdict"] == "good", "the verdict")
    assert update_of(mode)["unsaved"]
    mode.receive(pm.Save())
    found = update_of(mode)
    assert (found["written"], found["unsaved"], found["sentence"]) == (["room.toml"], False, "Saved: press Finish.")
    assert task.saved[0].picks == {"cam01": {"door": (5.0, 6.0)}}
    mode.receive(lm.Finish())
    assert mode.finished


def test_save_solves_what_was_changed_just_now(page):
    mode, task = page
    mode.tick()
    mode.receive(pm.Pick("cam01", "door", (5.0, 6.0)))
    mode.receive(pm.Save())  # the thread may not have solved it yet
    assert len(task.saved) == 1


def test_finish_asks_once_where_changes_are_not_saved(page):
    mode, _ = page
    mode.receive(pm.SetPoint("lamp", (0.0, 2.0, 0.0)))
    with pytest.raises(UserError, match="there are changes that are not saved: press Save, or Finish again"):
        mode.receive(lm.Finish())
    assert not mode.finished
    mode.receive(lm.Finish())
    assert mode.finished


def test_a_refused_change_leaves_everything_as_it_was(page):
    mode, _ = page
    mode.tick()
    before = mode._placed
    for command, message in (
        (pm.Pick("cam02", "door", (1.0, 1.0)), "cam02: no picture yet, or no such camera"),
        (pm.Pick("cam01", "gate", (1.0, 1.0)), "gate: no such point"),
        (pm.Pick("cam01", "door", (5000.0, 1.0)), "allowed: inside the picture of 96 x 64 px"),
        (pm.SetField("width", 1.0), "width: allowed: t"),
        (pm.NewPicture("cam02"), "cam02: no such camera; there are: cam01"),
        (pm.RemovePoint("gate"), "gate: no such point"),
        (lm.Calibrate(), "Calibrate: not on this page"),
    ):
        with pytest.raises(UserError, match=message):
            mode.receive(command)
    assert mode._placed is before


@pytest.mark.parametrize("page", [lambda: Task(editable=False)], indirect=True)
def test_points_of_a_fixed_task_cannot_be_changed(page):
    mode, _ = page
    for command in (pm.SetPoint("lamp", (0.0, 0.0, 0.0)), pm.RenamePoint("door", "gate"), pm.RemovePoint("door")):
        with pytest.raises(UserError, match="not on this page"):
            mode.receive(command)
    assert list(mode._placed.points) == ["door"]


@pytest.mark.parametrize(
    ("page", "text"),
    [
        (lambda: Task(failure=UserError("points.toml: wrong")), "points.toml: wrong"),
        (lambda: Task(failure=ValueError("odd")), "solving the cameras failed: odd"),
    ],
    indirect=["page"],
)
def test_a_failure_is_shown_instead_of_waiting(page, text):
    mode, _ = page
    until(lambda: update_of(mode)["sentence"] == text, "the failure")
    assert (update_of(mode)["busy"], update_of(mode)["verdict"]) == (False, "")
