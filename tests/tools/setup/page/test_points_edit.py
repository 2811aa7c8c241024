"""Changes of points and picks on the page, and their refusals: the state before stays."""

import pytest

from zenocap.common.errors import UserError
from zenocap.tools.setup.page.parameters import MOST_POINTS
from zenocap.tools.setup.page.point_messages import RemovePoint, RenamePoint, SetPoint
from zenocap.tools.setup.page.points_edit import cleared, edited, measured, picked
from zenocap.tools.setup.page.points_task import Placed

SIZE = (640, 480)
PLACED = Placed(
    {"door": (1.0, 0.0, 0.0), "lamp": (0.0, 2.0, None)},
    {"d_x": 1.0, "t": None},
    {"cam01": {"door": (10.0, 20.0), "lamp": (30.0, 40.0)}},
    {"cam01": SIZE, "cam02": SIZE},
    {"cam01": SIZE},
)


def test_a_point_is_added_moved_renamed_and_removed_with_its_picks():
    added = edited(PLACED, SetPoint("pole", (None, None, None)))
    assert list(added.points) == ["door", "lamp", "pole"]
    moved = edited(PLACED, SetPoint("door", (2.0, 0.0, 0.5)))
    assert moved.points["door"] == (2.0, 0.0, 0.5)
    assert moved.picks == PLACED.picks
    renamed = edited(PLACED, RenamePoint("door", "gate"))
    assert list(renamed.points) == ["gate", "lamp"]  # the order of the table stays
    assert renamed.picks["cam01"] == {"gate": (10.0, 20.0), "lamp": (30.0, 40.0)}
    removed = edited(PLACED, RemovePoint("door"))
    assert (list(removed.points), list(removed.picks["cam01"])) == (["lamp"], ["lamp"])
    assert list(PLACED.points) == ["door", "lamp"]


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (SetPoint("size", (0.0, 0.0, 0.0)), "a point of the name size: allowed: any other name"),
        (RenamePoint("gate", "door"), "gate: no such point; there are: door, lamp"),
        (RenamePoint("door", "lamp"), "door: renamed to lamp: allowed: a name that no other point has, and not size"),
        (RenamePoint("door", "size"), "door: renamed to size: allowed"),
        (RemovePoint("gate"), "gate: no such point; there are: door, lamp"),
    ],
)
def test_wrong_names_are_refused(command, message):
    with pytest.raises(UserError) as error:
        edited(PLACED, command)
    assert str(error.value).startswith(message)


def test_the_number_of_points_is_limited_and_a_full_table_can_be_changed():
    full = Placed({f"p{k}": (0.0, 0.0, float(k)) for k in range(MOST_POINTS)})
    with pytest.raises(UserError, match=f"{MOST_POINTS} points: allowed: up to {MOST_POINTS}"):
        edited(full, SetPoint("one more", (0.0, 0.0, 0.0)))
    assert edited(full, SetPoint("p3", (9.0, 0.0, 0.0))).points["p3"] == (9.0, 0.0, 0.0)
    with pytest.raises(UserError, match="gate: no such point; there are: none"):
        edited(Placed({}), RemovePoint("gate"))


def test_a_pick_is_placed_moved_and_taken_back_with_the_size_of_its_picture():
    first = picked(PLACED, "cam02", "door", (5.0, 6.0))
    assert first.picks["cam02"] == {"door": (5.0, 6.0)}
    assert first.picked_sizes == {"cam01": SIZE, "cam02": SIZE}
    assert picked(first, "cam02", "door", (7.0, 8.0)).picks["cam02"] == {"door": (7.0, 8.0)}
    back = picked(first, "cam02", "door", None)
    assert back.picks["cam02"] == {}
    assert back.picked_sizes == {"cam01": SIZE}  # without picks, any picture fits
    assert picked(PLACED, "cam02", "door", None).picks["cam02"] == {}


@pytest.mark.parametrize(
    ("placed", "camera", "point", "pixel", "message"),
    [
        (PLACED, "cam03", "door", (1.0, 1.0), "cam03: no picture yet, or no such camera"),
        (PLACED, "cam01", "gate", (1.0, 1.0), "gate: no such point; there are: door, lamp"),
        (PLACED, "cam01", "door", (640.0, 1.0), "cam01: door = (640, 1): allowed: inside the picture of 640 x 480 px"),
        (PLACED, "cam01", "door", (1.0, -0.6), "cam01: door = (1, -0.6): allowed: inside the picture of 640 x 480 px"),
        (PLACED, "cam01", "door", (float("nan"), 1.0), "cam01: door = (nan, 1): allowed"),
        (Placed({}, sizes=PLACED.sizes), "cam01", "door", (1.0, 1.0), "door: no such point; there are: none: add one"),
    ],
)
def test_wrong_picks_name_camera_point_and_range(placed, camera, point, pixel, message):
    with pytest.raises(UserError) as error:
        picked(placed, camera, point, pixel)
    assert str(error.value).startswith(message)


def test_pixels_at_the_very_edges_are_inside():
    for pixel in ((-0.5, -0.5), (639.5, 479.5)):
        assert picked(PLACED, "cam01", "door", pixel).picks["cam01"]["door"] == pixel


def test_a_picture_of_another_size_refuses_picks_until_its_points_are_cleared():
    larger = Placed(PLACED.points, {}, PLACED.picks, {"cam01": (1280, 720)}, PLACED.picked_sizes)
    with pytest.raises(UserError, match="its picture has 1280 x 720 px, its points were placed in 640 x 480"):
        picked(larger, "cam01", "door", (1000.0, 700.0))
    again = picked(cleared(larger, "cam01"), "cam01", "door", (1000.0, 700.0))
    assert again.picked_sizes == {"cam01": (1280, 720)}
    assert again.size_problem("cam01") == ""
    assert cleared(PLACED, "cam02") is PLACED  # it has no picks


def test_measures_are_those_of_the_page():
    assert measured(PLACED, "t", 1.7).fields == {"d_x": 1.0, "t": 1.7}
    assert measured(PLACED, "d_x", None).fields["d_x"] is None
    with pytest.raises(UserError, match="width: allowed: d_x, t"):
        measured(PLACED, "width", 1.0)
    with pytest.raises(UserError, match="t: allowed: no measure on this page"):
        measured(Placed({}), "t", 1.0)
