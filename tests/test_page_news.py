"""What the page is told is what the state says, in the numbers that the kinematics give."""

import json
from base64 import b64decode
from pathlib import Path

import numpy as np
import pytest
from animator_stand_in import (
    SETUP,
    assignment,
    bap,
    body,
    body_message,
    health,
    mask_of,
    pose_at,
    said,
    sighting,
    silhouette,
)

from common import messages as m
from common.body.anatomy import TEN_PARTS
from common.body.kinematics import joint_centres
from common.bus.protocol import Tick
from common.conversion import camera_of, packed_points
from common.runtime.rig import demo_rig
from common.vision.packing import unpack
from services.animator.page.display import CHECKS_NS, POSED_NS, ROWS_NS, VIEWS_NS, Shown, show
from services.animator.page.hub import Piece
from services.animator.page.news import checks, news, rows, views
from services.animator.page.wire import Ask, Control, ListTakes, Play, Watch, Wish, wish_of
from services.animator.states import State
from services.animator.step import initial_state, step
from services.viewer.shell import camera_info

NOW = 1_700_000_000_000_000_000
CAMERAS = [camera_info(viewer, NOW) for viewer in demo_rig().viewers]


def after(*messages: m.Message, state: State | None = None, now_ns: int = NOW) -> State:
    state = state or initial_state(SETUP)
    for message in messages:
        state, _ = step(SETUP, state, said(message, now_ns))
    return state


def decoded(pieces: list[Piece]) -> dict[str, dict[str, object]]:
    return {piece.name: json.loads(piece.data) for piece in pieces}


def full() -> State:
    pose = pose_at(0.0)
    masks = [silhouette(v.id, 1, NOW, mask_of(v.camera, pose)) for v in demo_rig().viewers]
    return after(*CAMERAS, body_message(NOW), *masks, sighting("1", 1, NOW), assignment(1, NOW, pose), bap(1, NOW, pose))


def test_a_pose_has_the_joint_centres_of_the_kinematics() -> None:
    pose = pose_at(0.3)
    told = decoded(list(news(State(), after(body_message(NOW), bap(5, NOW, pose)))))
    centres = np.reshape(told["pose/two-view"]["centres"], (-1, 3))
    np.testing.assert_allclose(centres, joint_centres(TEN_PARTS, body(), pose), atol=6e-4)
    assert told["body/two-view"]["markers"] == [marker.name for marker in TEN_PARTS.markers]
    assert told["pose/two-view"]["captured_ms"] == pytest.approx(NOW / 1e6)


def test_only_what_is_new_is_told() -> None:
    before = full()
    assert [piece.name for piece in news(before, before)] == []
    assert [piece.name for piece in news(before, after(bap(2, NOW, pose_at(0.1)), state=before))] == ["pose/two-view"]


def test_a_cameras_corners_are_what_it_projects_to_the_corners_of_its_picture() -> None:
    told = decoded(list(news(State(), after(*CAMERAS))))
    for info in CAMERAS:
        corners = np.reshape(told[f"camera/{info.viewer}"]["corners"], (4, 3))
        width, height = info.size
        expected = np.array([[-0.5, -0.5], [width - 0.5, -0.5], [width - 0.5, height - 0.5], [-0.5, height - 0.5]])
        np.testing.assert_allclose(camera_of(info).project(corners), expected, atol=0.05)


def test_the_models_outline_surrounds_its_own_silhouette() -> None:
    state = full()
    for viewer, told in ((one["viewer"], one) for one in decoded(list(views(state))).values()):
        seen = state.silhouettes[str(viewer)]
        rows_of, columns = np.nonzero(unpack(seen.size, seen.region, seen.data))
        corners = np.concatenate([np.reshape(one["corners"], (-1, 2)) for one in told["outlines"]["two-view"]])  # type: ignore[index]
        assert corners[:, 0].min() == pytest.approx(columns.min(), abs=1.0)
        assert corners[:, 0].max() == pytest.approx(columns.max(), abs=1.0)
        assert corners[:, 1].min() == pytest.approx(rows_of.min(), abs=1.0)
        assert corners[:, 1].max() == pytest.approx(rows_of.max(), abs=1.0)


def test_no_model_is_drawn_of_a_person_who_is_lost() -> None:
    lost = after(bap(2, NOW, pose_at(0.0), ["person"]), state=full())
    assert all(one["outlines"] == {} for one in decoded(list(views(lost))).values())


def test_rows_say_who_is_ill_and_whether_a_take_is_written() -> None:
    state = after(health("integrator", "main", NOW, log_messages=12, log_on=1, log_lost=3), state=full())
    state, _ = step(SETUP, state, Tick(NOW + 1_100_000_000))
    told = json.loads(rows(state, 2).data)
    assert [(row["name"], row["id"], row["condition"]) for row in told["rows"]] == [
        ("viewer", "1", "stale"), ("viewer", "2", "stale"), ("integrator", "main", "well"),
    ]  # fmt: skip
    assert told["rows"][2]["dropped"] == 3
    assert (told["recording"], told["log"], told["pages"]) == (True, 12, 2)
    assert json.loads(rows(full(), 0).data)["recording"] is None


@pytest.mark.parametrize(
    ("counts", "recording"),
    [({"log_on": 0}, False), ({"log_on": 1}, True), ({"log_on": 1, "log_stopped": 1}, False)],
)
def test_a_log_that_stopped_is_not_recording(counts: dict[str, int], recording: bool) -> None:
    assert json.loads(rows(after(health("integrator", "main", NOW, **counts)), 0).data)["recording"] is recording


def test_checks_tell_each_viewer_what_to_do_and_the_rig_what_it_waits_for() -> None:
    pose = pose_at(0.0)
    state = after(
        health("viewer", "2", NOW, "learning the background (3 frames)"),
        health("integrator", "main", NOW, "waiting for the initial posture in both views"),
        assignment(2, NOW, pose, tracking=False),
        state=full(),
    )
    told = json.loads(checks(state).data)
    assert told["advice"] == "waiting for the initial posture in both views"
    first = {check["name"]: check["verdict"] for check in told["viewers"]["1"]}
    assert first["background"] == "wait"  # nothing was heard of it
    assert first["posture"] == "bad"  # walking, not standing with stretched arms
    second = {check["name"]: check for check in told["viewers"]["2"]}
    assert "keep the scene empty" in second["background"]["words"]


def test_a_damaged_silhouette_is_said_to_be() -> None:
    broken = m.Silhouette(frame=1, captured_ns=NOW, viewer="1", size=(160, 120), region=(0, 0, 8, 8), data=b"no")
    told = json.loads(checks(after(broken)).data)
    assert [check["verdict"] for check in told["viewers"]["1"]][-1] == "bad"


def test_silhouettes_wait_for_the_pose_that_fits_them() -> None:
    camera = demo_rig().viewers[0].camera
    shown, first = show(Shown(), full(), 1)
    assert "view/1" in [piece.name for piece in first]
    later_ns = NOW + 2 * VIEWS_NS
    mask = silhouette("1", 2, later_ns, mask_of(camera, pose_at(0.1)))
    state = after(mask, state=shown.state, now_ns=later_ns)
    shown, pieces = show(shown, state, 1)
    assert "view/1" not in [piece.name for piece in pieces]
    shown, pieces = show(shown, after(bap(2, later_ns, pose_at(0.1)), state=state, now_ns=later_ns), 1)
    assert {"view/1", "pose/two-view"} <= {piece.name for piece in pieces}


def test_silhouettes_are_shown_where_no_poses_come() -> None:
    shown, _ = show(Shown(), full(), 1)
    late_ns = NOW + 2 * POSED_NS
    mask = silhouette("1", 2, late_ns, mask_of(demo_rig().viewers[0].camera, pose_at(0.1)))
    _, pieces = show(shown, after(mask, state=shown.state, now_ns=late_ns), 1)
    assert "view/1" in [piece.name for piece in pieces]


def test_poses_are_shown_as_they_come_and_the_rest_at_its_own_pace() -> None:
    state, shown = full(), Shown()
    names: list[str] = []
    for k in range(60):  # a second
        now_ns = NOW + k * 1_000_000_000 // 60
        mask = silhouette("1", k, now_ns, mask_of(demo_rig().viewers[0].camera, pose_at(0.0)))
        state = after(mask, bap(k, now_ns, pose_at(0.0)), state=state, now_ns=now_ns)
        shown, pieces = show(shown, state, 1)
        names += [piece.name for piece in pieces]
    assert names.count("pose/two-view") == 60
    assert names.count("view/1") <= 1 + 1_000_000_000 // VIEWS_NS
    assert names.count("rows") <= 1 + 1_000_000_000 // ROWS_NS
    assert names.count("checks") <= 1 + 1_000_000_000 // CHECKS_NS
    assert show(shown, state, 1) == (shown, [])


@pytest.mark.parametrize(
    ("text", "wish"),
    [
        ('{"is":"ask","what":"measure"}', Ask("measure")),
        ('{"is":"watch","feed":"take"}', Watch("take")),
        ('{"is":"list"}', ListTakes()),
        ('{"is":"play","take":"demo-1.mcap"}', Play("demo-1.mcap")),
        ('{"is":"control","paused":true,"place_s":1.5}', Control(True, 1.5)),
    ],
)
def test_a_page_may_wish(text: str, wish: Wish) -> None:
    assert wish_of(text) == wish


@pytest.mark.parametrize(
    "text",
    [
        "", "[]", '{"is":"ask","what":"reboot"}', '{"is":"play","take":"../../a.mcap"}', '{"is":"play","take":"/a.mcap"}',
        '{"is":"play","take":"a/b.mcap"}', '{"is":"control","rate":0}', '{"is":"control","place_s":-1}',
        '{"is":"control","place_s":1e999}', '{"is":"watch","feed":"live","more":1}', '{"is":"other"}',
    ],
)  # fmt: skip
def test_anything_else_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="a page asks for what there is not"):
        wish_of(text)


def test_the_pages_files_are_part_of_the_package() -> None:
    folder = Path(__file__).resolve().parents[1] / "services" / "animator" / "page" / "static"
    assert {"index.html", "main.js", "style.css"} <= {path.name for path in folder.iterdir()}
    project = (Path(__file__).resolve().parents[1] / "pyproject.toml").read_text()
    assert '"services.animator.page" = ["static/*"]' in project


def test_scene_points_go_to_the_page_as_they_are_and_damaged_ones_do_not() -> None:
    def said_points(data: bytes) -> dict[str, dict[str, object]]:
        return decoded(list(news(State(), after(m.ScenePoints(frame=1, captured_ns=NOW, points=data)))))

    told = said_points(packed_points(np.array([[1.0, -2.0, 0.5]])))
    assert np.frombuffer(b64decode(str(told["points"]["data"])), "<i2").tolist() == [1000, -2000, 500]
    assert "points" not in said_points(b"12345")
