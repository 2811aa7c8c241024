"""Updates of the page: they match the state and the kinematics, and are sent when they are due."""

import json
from base64 import b64decode
from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest

from tests.support import animator_stand_in as stand_in
from tests.support.animator_stand_in import NOW, after, assignment, bap, body_message, health, pose_at, sighting
from tests.support.animator_stand_in import observed_after as heard
from tests.support.built_messages import built, silhouette
from tests.support.places import ROOT
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.bus.protocol import Alive
from zenocap.common.conversion import camera_of, packed_points
from zenocap.common.observe.losses import LOSSES
from zenocap.common.rig.rig import demo_rig
from zenocap.common.vision.mask_codec import unpack
from zenocap.common.web.broadcast import EncodedUpdate
from zenocap.services.animator import parameters
from zenocap.services.animator.page import page_messages as pm
from zenocap.services.animator.page import page_updates as updates_module
from zenocap.services.animator.page.page_updates import Schedule, due_updates
from zenocap.services.animator.states import AnimatorState
from zenocap.services.viewer.shell import camera_info

VIEWERS = demo_rig("two-view").viewers
CAMERAS = [camera_info(viewer, NOW) for viewer in VIEWERS]


def decoded(updates: Iterable[EncodedUpdate]) -> dict[str, Any]:
    return {update.key: json.loads(update.data) for update in updates}


def changes(before: AnimatorState, after: AnimatorState) -> dict[str, Any]:
    """The updates between two states by key."""
    return decoded(updates_module.changes(before, after))


def changes_by(*messages: m.Message) -> dict[str, Any]:
    """The updates that messages cause in a new animator."""
    return changes(AnimatorState(), after(*messages))


def services_of(*messages: m.Message, state: AnimatorState | None = None) -> dict[str, Any]:
    """The update of the services after messages."""
    return json.loads(updates_module.services_update(state or AnimatorState(), heard(*messages), 0, NOW).data)


def losses_of(report: m.Health) -> list[list[object]]:
    """The losses that the page shows of a service after its health."""
    (row,) = (row for row in services_of(report)["services"] if (row["name"], row["id"]) == (report.service, report.id))
    return row["losses"]


def checks_of(state: AnimatorState, *reports: m.Health) -> dict[str, Any]:
    return json.loads(updates_module.checks_update(state, heard(*reports)).data)


def due(schedule: Schedule, state: AnimatorState, now_ns: int = NOW) -> tuple[Schedule, list[str]]:
    """The schedule, and keys of the updates that are due."""
    schedule, updates = due_updates(schedule, state, heard(), 1, now_ns)
    return schedule, [update.key for update in updates]


def mask(frame: int, captured_ns: int, time_s: float) -> m.Silhouette:
    """Silhouette of viewer 1."""
    return silhouette("1", frame, captured_ns, stand_in.mask_of(VIEWERS[0].camera, pose_at(time_s)))


def full() -> AnimatorState:
    pose = pose_at(0.0)
    masks = [silhouette(viewer.id, 1, NOW, stand_in.mask_of(viewer.camera, pose)) for viewer in VIEWERS]
    return after(*CAMERAS, body_message(NOW), *masks, sighting("1", 1, NOW), assignment(1, NOW, pose), bap(1, NOW, pose))


def test_a_pose_has_the_joint_centres_of_the_kinematics() -> None:
    pose = pose_at(0.3)
    sent = changes_by(body_message(NOW), bap(5, NOW, pose))
    centres = np.reshape(sent["pose/two-view"]["centres"], (-1, 3))
    np.testing.assert_allclose(centres, joint_centres(TEN_PARTS, stand_in.body(), pose), atol=6e-4)
    assert sent["body/two-view"]["markers"] == [marker.name for marker in TEN_PARTS.markers]
    assert sent["pose/two-view"]["captured_ms"] == pytest.approx(NOW / 1e6)


def test_only_changes_are_sent() -> None:
    before = full()
    assert changes(before, before) == {}
    assert list(changes(before, after(bap(2, NOW, pose_at(0.1)), state=before))) == ["pose/two-view"]


def test_the_corners_of_a_camera_project_to_the_corners_of_its_image() -> None:
    sent = changes_by(*CAMERAS)
    for info in CAMERAS:
        corners = np.reshape(sent[f"camera/{info.viewer}"]["corners"], (4, 3))
        width, height = info.size
        expected = np.array([[-0.5, -0.5], [width - 0.5, -0.5], [width - 0.5, height - 0.5], [-0.5, height - 0.5]])
        np.testing.assert_allclose(camera_of(info).project(corners), expected, atol=0.05)


def test_the_models_outlines_enclose_its_own_silhouette() -> None:
    state = full()
    for sent in decoded(updates_module.view_updates(state)).values():
        seen = state.silhouettes[sent["viewer"]]
        rows_and_columns = np.argwhere(unpack(seen.size, seen.region, seen.data))
        corners = np.concatenate([np.reshape(one["corners"], (-1, 2)) for one in sent["outlines"]["two-view"]])
        for edge in (np.min, np.max):
            np.testing.assert_allclose(edge(corners, axis=0), edge(rows_and_columns, axis=0)[::-1], atol=1.0)


def test_a_lost_person_has_no_outlines() -> None:
    lost = after(bap(2, NOW, pose_at(0.0), ["person"]), state=full())
    assert all(one["outlines"] == {} for one in decoded(updates_module.view_updates(lost)).values())


def test_the_services_have_their_condition_losses_and_recording() -> None:
    log = health("integrator", "main", NOW, log_messages=12, log_on=1, log_lost=3)
    presence = heard(Alive("integrator", "main", True, NOW), sighting("1", 1, NOW), sighting("2", 1, NOW), log)
    sent = json.loads(updates_module.services_update(AnimatorState(), presence, 2, NOW + 1_100_000_000).data)
    assert [(row["name"], row["id"], row["condition"]) for row in sent["services"]] == [
        ("viewer", "1", "stale"), ("viewer", "2", "stale"), ("integrator", "main", "ok"),
    ]  # fmt: skip
    assert sent["services"][2]["losses"] == [["log_lost", "messages not recorded", 3, 15]]
    assert (sent["recording"], sent["log"], sent["pages"]) == (True, 12, 2)
    assert services_of()["recording"] is None
    assert json.loads(updates_module.recording_update(presence).data) == {
        "type": "recording", "recording": True, "log": 12,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("counts", "recording"), [({"log_on": 0}, False), ({"log_on": 1}, True), ({"log_on": 1, "log_stopped": 1}, False)]
)
def test_a_log_that_is_off_or_has_failed_is_not_recording(counts: dict[str, int], recording: bool) -> None:
    assert services_of(health("integrator", "main", NOW, **counts))["recording"] is recording


def test_checks_have_advice_for_each_viewer_and_for_the_rig() -> None:
    sent = checks_of(
        after(assignment(2, NOW, pose_at(0.0), tracking=False), state=full()),
        health("viewer", "2", NOW, "learning the background (3 frames)", m.Phase.LEARNING_BACKGROUND),
        health("integrator", "main", NOW, "waiting for the T-pose in both views", m.Phase.AWAITING_PERSON),
    )
    assert (sent["advice"], sent["calm"]) == ("waiting for the T-pose in both views", False)
    assert not checks_of(full())["calm"]
    first = {check["name"]: check["verdict"] for check in sent["viewers"]["1"]}
    assert first["background"] == "wait"  # no health received
    assert first["posture"] == "bad"  # walking, not standing with stretched arms
    second = {check["name"]: check for check in sent["viewers"]["2"]}
    assert "keep the scene empty" in second["background"]["text"]


@pytest.mark.parametrize(
    ("phase", "text", "calm"),
    [
        (m.Phase.TRACKING, "tracking", True),
        (m.Phase.TRACKING, "tracking, without viewer 2", False),
        (m.Phase.TRACKING, "tracking, the body does not fit the scene", False),
        (m.Phase.LOST, "searching for the person", False),
        (m.Phase.LOST, "tracking", False),
    ],
)
def test_the_advice_is_calm_when_nothing_is_to_be_done(phase: m.Phase, text: str, calm: bool) -> None:
    sent = checks_of(AnimatorState(), health("tracker", "hybrid", NOW, text, phase))
    assert (sent["advice"], sent["calm"]) == (text, calm)


def test_a_damaged_silhouette_is_a_bad_check() -> None:
    sent = checks_of(after(built(m.Silhouette, captured_ns=NOW, region=(0, 0, 8, 8), data=b"no")))
    assert [check["verdict"] for check in sent["viewers"]["1"]][-1] == "bad"


def test_silhouettes_wait_for_the_pose_of_their_instant() -> None:
    schedule, first = due(Schedule(), full())
    assert "view/1" in first
    later_ns = NOW + 2 * parameters.VIEWS_PERIOD_NS
    state = after(mask(2, later_ns, 0.1), state=schedule.state, now_ns=later_ns)
    schedule, updates = due(schedule, state, later_ns)
    assert "view/1" not in updates
    schedule, updates = due(schedule, after(bap(2, later_ns, pose_at(0.1)), state=state, now_ns=later_ns), later_ns)
    assert {"view/1", "pose/two-view"} <= set(updates)


def test_silhouettes_are_sent_without_poses() -> None:
    schedule, _ = due(Schedule(), full())
    late_ns = NOW + 2 * parameters.POSE_WAIT_NS
    _, updates = due(schedule, after(mask(2, late_ns, 0.1), state=schedule.state, now_ns=late_ns), late_ns)
    assert "view/1" in updates


@pytest.mark.slow
def test_poses_are_sent_at_once_and_other_updates_at_their_own_rate() -> None:
    state, schedule, names = full(), Schedule(), []
    for k in range(60):  # a second
        now_ns = NOW + k * 1_000_000_000 // 60
        state = after(mask(k, now_ns, 0.0), bap(k, now_ns, pose_at(0.0)), state=state, now_ns=now_ns)
        schedule, updates = due(schedule, state, now_ns)
        names += updates
    assert names.count("pose/two-view") == 60
    assert names.count("view/1") <= 1 + 1_000_000_000 // parameters.VIEWS_PERIOD_NS
    assert names.count("services") <= 1 + 1_000_000_000 // parameters.SERVICES_PERIOD_NS
    assert names.count("checks") <= 1 + 1_000_000_000 // parameters.CHECKS_PERIOD_NS
    assert due(schedule, state) == (schedule, [])


@pytest.mark.parametrize(
    ("text", "command"),
    [
        ('{"type":"request","what":"measure"}', pm.RigRequest("measure")),
        ('{"type":"select_feed","feed":"take"}', pm.SelectFeed("take")),
        ('{"type":"list_takes"}', pm.ListTakes()),
        ('{"type":"play_take","take":"demo-1.mcap"}', pm.PlayTake("demo-1.mcap")),
        ('{"type":"control_player","paused":true,"position_s":1.5}', pm.ControlPlayer(True, 1.5)),
    ],
)
def test_valid_commands_are_decoded(text: str, command: pm.Command) -> None:
    assert pm.decode_command(text) == command


@pytest.mark.parametrize(
    "text",
    [
        "", "[]", '{"type":"other"}', '{"type":"request","what":"reboot"}', '{"type":"select_feed","feed":"live","more":1}',
        '{"type":"play_take","take":"../../a.mcap"}', '{"type":"play_take","take":"/a.mcap"}',
        '{"type":"play_take","take":"a/b.mcap"}', '{"type":"control_player","rate":0}',
        '{"type":"control_player","position_s":-1}', '{"type":"control_player","position_s":1e999}',
    ],
)  # fmt: skip
def test_invalid_commands_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="invalid command from a page"):
        pm.decode_command(text)


def test_the_pages_files_are_part_of_the_package() -> None:
    folder = ROOT / "services" / "animator" / "page" / "static"
    assert {"index.html", "main.js", "style.css"} <= {path.name for path in folder.iterdir()}
    project = (ROOT / "pyproject.toml").read_text()
    assert '"zenocap.services.animator.page" = ["static/*"]' in project
    assert '"zenocap.common.web" = ["static/*"]' in project


def test_scene_points_are_sent_unchanged_and_damaged_ones_are_not() -> None:
    points = packed_points(np.array([[1.0, -2.0, 0.5]]))
    sent = changes_by(m.ScenePoints(frame=1, captured_ns=NOW, points=points))["points"]["data"]
    assert np.frombuffer(b64decode(sent), "<i2").tolist() == [1000, -2000, 500]
    assert "points" not in changes_by(m.ScenePoints(frame=1, captured_ns=NOW, points=b"12345"))


def test_the_latest_commands_are_sent_together_oldest_first() -> None:
    shown = parameters.COMMANDS_SHOWN
    before = after(stand_in.command_result(0, NOW, "demo/slides/first"))
    results = [stand_in.command_result(1 + k, NOW, "demo/slides/next") for k in range(shown + 3)]
    sent = changes(before, after(*results, state=before))["commands"]
    assert sent["live"] is True
    assert [row["number"] for row in sent["commands"]] == list(range(4, shown + 4))
    assert sent["commands"][-1] == {
        "number": shown + 3, "captured_ms": pytest.approx(NOW / 1e6 - 20), "posture": "raise-right-arm",
        "action": "zenoh", "target": "demo/slides/next", "confidence": 0.4, "latency_ms": 20.0, "since_end_ms": 320.0,
        "since_start_ms": 2320.0, "outcome": "done",
    }  # fmt: skip


def test_a_page_that_opens_gets_earlier_commands_as_such() -> None:
    """Also an empty list, so that the first command afterwards is known to be new."""
    assert changes_by(stand_in.command_result(0, NOW, "a"))["commands"]["live"] is False
    none = changes(AnimatorState(), full())["commands"]
    assert (none["commands"], none["live"]) == ([], False)
    assert "commands" not in changes(full(), full())


@pytest.mark.parametrize(
    ("service", "counts", "losses"),
    [
        (
            ("viewer", "1"), {"frames": 60, "dropped_frames": 4, "skipped_frames": 36, "kept_percent": 67},
            [
                ["dropped_frames", "camera frames dropped", 4, 100],
                ["skipped_frames", "camera frames skipped under overload", 36, 100],
            ],
        ),
        (
            ("recognizer", "main"), {"commands_done": 9, "commands_failed": 2, "commands_dropped": 1},
            [["commands_failed", "commands failed", 2, 0], ["commands_dropped", "commands dropped", 1, 0]],
        ),
    ],
    ids=["frames of a viewer", "commands of the recognizer"],
)  # fmt: skip
def test_losses_of_a_service(service: tuple[str, str], counts: dict[str, int], losses: list[list[object]]) -> None:
    assert losses_of(health(*service, NOW, **counts)) == losses


def test_the_page_gets_what_is_left_out_under_overload() -> None:
    rate = m.FrameRate(
        frame=0, captured_ns=1, keep=1, of=2, from_ns=1, phase_ns=0, fps=30.0, limit="viewers", viewers=["1"]
    )  # fmt: skip
    state = after(rate, m.TrackerDetail(frame=0, captured_ns=1, share=0.5))
    reduced = services_of(state=state)["reduced"]
    assert reduced == "reduced to 15 of 30 frames/s: processor of viewer 1; tracker with 50% of its points"
    full = m.FrameRate(frame=1, captured_ns=2, keep=1, of=1, from_ns=2, phase_ns=0, fps=30.0)
    assert services_of(state=after(full))["reduced"] == ""


def test_the_page_explains_every_loss() -> None:
    """The names in the table of losses are the keys of the explanations in `side_panel.js`."""
    names = {one.name for one in LOSSES if one.text}
    script = (ROOT / "services" / "animator" / "page" / "static" / "side_panel.js").read_text(encoding="utf-8")
    assert all(f"  {name}: '" in script for name in names)
