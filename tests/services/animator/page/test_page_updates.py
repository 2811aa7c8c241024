"""Updates of the page: they match the state and the kinematics, and are sent when they are due."""

import json
from base64 import b64decode
from typing import Any

import numpy as np
import pytest

from tests.support.animator_stand_in import (
    EXPECTED,
    SETUP,
    assignment,
    bap,
    body,
    body_message,
    command_result,
    health,
    mask_of,
    pose_at,
    received,
    sighting,
    silhouette,
)
from tests.support.places import ROOT
from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.body.kinematics import joint_centres
from zenocap.common.bus.protocol import Alive
from zenocap.common.conversion import camera_of, packed_points
from zenocap.common.observe.losses import LOSSES
from zenocap.common.observe.view import RigView
from zenocap.common.rig.rig import demo_rig
from zenocap.common.vision.mask_codec import unpack
from zenocap.common.web.broadcast import EncodedUpdate
from zenocap.services.animator.page.page_messages import (
    Command,
    ControlPlayer,
    ListTakes,
    PlayTake,
    RigRequest,
    SelectFeed,
    decode_command,
)
from zenocap.services.animator.page.page_updates import (
    Schedule,
    changes,
    checks_update,
    due_updates,
    recording_update,
    services_update,
    view_updates,
)
from zenocap.services.animator.parameters import (
    CHECKS_PERIOD_NS,
    COMMANDS_SHOWN,
    POSE_WAIT_NS,
    SERVICES_PERIOD_NS,
    VIEWS_PERIOD_NS,
)
from zenocap.services.animator.presence import Presence, observed
from zenocap.services.animator.states import AnimatorState
from zenocap.services.animator.step import step
from zenocap.services.viewer.shell import camera_info

NOW = 1_700_000_000_000_000_000
CAMERAS = [camera_info(viewer, NOW) for viewer in demo_rig("two-view").viewers]


def after(*messages: m.Message, state: AnimatorState | None = None, now_ns: int = NOW) -> AnimatorState:
    state = state or AnimatorState()
    for message in messages:
        state, _ = step(SETUP, state, received(message, now_ns))
    return state


def heard(*events: m.Message | Alive) -> Presence:
    """Presence after events."""
    presence = Presence(RigView("demo", EXPECTED))
    for event in events:
        presence = observed(presence, event if isinstance(event, Alive) else received(event, NOW), NOW)
    return presence


def services_of(*messages: m.Message, state: AnimatorState | None = None) -> dict[str, Any]:
    """The update of the services after messages."""
    found: dict[str, Any] = json.loads(services_update(state or AnimatorState(), heard(*messages), 0, NOW).data)
    return found


def due(schedule: Schedule, state: AnimatorState, now_ns: int = NOW) -> tuple[Schedule, list[EncodedUpdate]]:
    return due_updates(schedule, state, heard(), 1, now_ns)


def decoded(updates: list[EncodedUpdate]) -> dict[str, dict[str, object]]:
    return {update.key: json.loads(update.data) for update in updates}


def full() -> AnimatorState:
    pose = pose_at(0.0)
    masks = [silhouette(v.id, 1, NOW, mask_of(v.camera, pose)) for v in demo_rig("two-view").viewers]
    return after(*CAMERAS, body_message(NOW), *masks, sighting("1", 1, NOW), assignment(1, NOW, pose), bap(1, NOW, pose))


def test_a_pose_has_the_joint_centres_of_the_kinematics() -> None:
    pose = pose_at(0.3)
    sent = decoded(list(changes(AnimatorState(), after(body_message(NOW), bap(5, NOW, pose)))))
    centres = np.reshape(sent["pose/two-view"]["centres"], (-1, 3))
    np.testing.assert_allclose(centres, joint_centres(TEN_PARTS, body(), pose), atol=6e-4)
    assert sent["body/two-view"]["markers"] == [marker.name for marker in TEN_PARTS.markers]
    assert sent["pose/two-view"]["captured_ms"] == pytest.approx(NOW / 1e6)


def test_only_changes_are_sent() -> None:
    before = full()
    assert [update.key for update in changes(before, before)] == []
    assert [update.key for update in changes(before, after(bap(2, NOW, pose_at(0.1)), state=before))] == ["pose/two-view"]


def test_the_corners_of_a_camera_project_to_the_corners_of_its_image() -> None:
    sent = decoded(list(changes(AnimatorState(), after(*CAMERAS))))
    for info in CAMERAS:
        corners = np.reshape(sent[f"camera/{info.viewer}"]["corners"], (4, 3))
        width, height = info.size
        expected = np.array([[-0.5, -0.5], [width - 0.5, -0.5], [width - 0.5, height - 0.5], [-0.5, height - 0.5]])
        np.testing.assert_allclose(camera_of(info).project(corners), expected, atol=0.05)


def test_the_models_outlines_enclose_its_own_silhouette() -> None:
    state = full()
    for viewer, sent in ((one["viewer"], one) for one in decoded(list(view_updates(state))).values()):
        seen = state.silhouettes[str(viewer)]
        rows_of, columns = np.nonzero(unpack(seen.size, seen.region, seen.data))
        corners = np.concatenate([np.reshape(one["corners"], (-1, 2)) for one in sent["outlines"]["two-view"]])  # type: ignore[index]
        assert corners[:, 0].min() == pytest.approx(columns.min(), abs=1.0)
        assert corners[:, 0].max() == pytest.approx(columns.max(), abs=1.0)
        assert corners[:, 1].min() == pytest.approx(rows_of.min(), abs=1.0)
        assert corners[:, 1].max() == pytest.approx(rows_of.max(), abs=1.0)


def test_a_lost_person_has_no_outlines() -> None:
    lost = after(bap(2, NOW, pose_at(0.0), ["person"]), state=full())
    assert all(one["outlines"] == {} for one in decoded(list(view_updates(lost))).values())


def test_the_services_have_their_condition_losses_and_recording() -> None:
    log = health("integrator", "main", NOW, log_messages=12, log_on=1, log_lost=3)
    presence = heard(Alive("integrator", "main", True, NOW), sighting("1", 1, NOW), sighting("2", 1, NOW), log)
    sent = json.loads(services_update(AnimatorState(), presence, 2, NOW + 1_100_000_000).data)
    assert [(row["name"], row["id"], row["condition"]) for row in sent["services"]] == [
        ("viewer", "1", "stale"), ("viewer", "2", "stale"), ("integrator", "main", "ok"),
    ]  # fmt: skip
    assert sent["services"][2]["losses"] == [["messages not recorded", 3, 15]]
    assert (sent["recording"], sent["log"], sent["pages"]) == (True, 12, 2)
    assert services_of()["recording"] is None


@pytest.mark.parametrize(
    ("counts", "recording"), [({"log_on": 0}, False), ({"log_on": 1}, True), ({"log_on": 1, "log_stopped": 1}, False)]
)
def test_a_log_that_is_off_or_has_failed_is_not_recording(counts: dict[str, int], recording: bool) -> None:
    assert services_of(health("integrator", "main", NOW, **counts))["recording"] is recording


def test_checks_have_advice_for_each_viewer_and_for_the_rig() -> None:
    pose = pose_at(0.0)
    presence = heard(
        health("viewer", "2", NOW, "learning the background (3 frames)", m.Phase.LEARNING_BACKGROUND),
        health("integrator", "main", NOW, "waiting for the T-pose in both views", m.Phase.AWAITING_PERSON),
    )
    sent = json.loads(checks_update(after(assignment(2, NOW, pose, tracking=False), state=full()), presence).data)
    assert sent["advice"] == "waiting for the T-pose in both views"
    first = {check["name"]: check["verdict"] for check in sent["viewers"]["1"]}
    assert first["background"] == "wait"  # no health received
    assert first["posture"] == "bad"  # walking, not standing with stretched arms
    second = {check["name"]: check for check in sent["viewers"]["2"]}
    assert "keep the scene empty" in second["background"]["text"]


def test_a_damaged_silhouette_is_a_bad_check() -> None:
    broken = m.Silhouette(frame=1, captured_ns=NOW, viewer="1", size=(160, 120), region=(0, 0, 8, 8), data=b"no")
    sent = json.loads(checks_update(after(broken), heard()).data)
    assert [check["verdict"] for check in sent["viewers"]["1"]][-1] == "bad"


def test_silhouettes_wait_for_the_pose_of_their_instant() -> None:
    camera = demo_rig("two-view").viewers[0].camera
    schedule, first = due(Schedule(), full())
    assert "view/1" in [update.key for update in first]
    later_ns = NOW + 2 * VIEWS_PERIOD_NS
    mask = silhouette("1", 2, later_ns, mask_of(camera, pose_at(0.1)))
    state = after(mask, state=schedule.state, now_ns=later_ns)
    schedule, updates = due(schedule, state, later_ns)
    assert "view/1" not in [update.key for update in updates]
    schedule, updates = due(schedule, after(bap(2, later_ns, pose_at(0.1)), state=state, now_ns=later_ns), later_ns)
    assert {"view/1", "pose/two-view"} <= {update.key for update in updates}


def test_silhouettes_are_sent_without_poses() -> None:
    schedule, _ = due(Schedule(), full())
    late_ns = NOW + 2 * POSE_WAIT_NS
    mask = silhouette("1", 2, late_ns, mask_of(demo_rig("two-view").viewers[0].camera, pose_at(0.1)))
    _, updates = due(schedule, after(mask, state=schedule.state, now_ns=late_ns), late_ns)
    assert "view/1" in [update.key for update in updates]


@pytest.mark.slow
def test_poses_are_sent_at_once_and_other_updates_at_their_own_rate() -> None:
    state, schedule = full(), Schedule()
    names: list[str] = []
    for k in range(60):  # a second
        now_ns = NOW + k * 1_000_000_000 // 60
        mask = silhouette("1", k, now_ns, mask_of(demo_rig("two-view").viewers[0].camera, pose_at(0.0)))
        state = after(mask, bap(k, now_ns, pose_at(0.0)), state=state, now_ns=now_ns)
        schedule, updates = due(schedule, state, now_ns)
        names += [update.key for update in updates]
    assert names.count("pose/two-view") == 60
    assert names.count("view/1") <= 1 + 1_000_000_000 // VIEWS_PERIOD_NS
    assert names.count("services") <= 1 + 1_000_000_000 // SERVICES_PERIOD_NS
    assert names.count("checks") <= 1 + 1_000_000_000 // CHECKS_PERIOD_NS
    assert due(schedule, state) == (schedule, [])


@pytest.mark.parametrize(
    ("text", "command"),
    [
        ('{"type":"request","what":"measure"}', RigRequest("measure")),
        ('{"type":"select_feed","feed":"take"}', SelectFeed("take")),
        ('{"type":"list_takes"}', ListTakes()),
        ('{"type":"play_take","take":"demo-1.mcap"}', PlayTake("demo-1.mcap")),
        ('{"type":"control_player","paused":true,"position_s":1.5}', ControlPlayer(True, 1.5)),
    ],
)
def test_valid_commands_are_decoded(text: str, command: Command) -> None:
    assert decode_command(text) == command


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        '{"type":"request","what":"reboot"}',
        '{"type":"play_take","take":"../../a.mcap"}',
        '{"type":"play_take","take":"/a.mcap"}',
        '{"type":"play_take","take":"a/b.mcap"}',
        '{"type":"control_player","rate":0}',
        '{"type":"control_player","position_s":-1}',
        '{"type":"control_player","position_s":1e999}',
        '{"type":"select_feed","feed":"live","more":1}',
        '{"type":"other"}',
    ],
)
def test_invalid_commands_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="invalid command from a page"):
        decode_command(text)


def test_the_pages_files_are_part_of_the_package() -> None:
    folder = ROOT / "services" / "animator" / "page" / "static"
    assert {"index.html", "main.js", "style.css"} <= {path.name for path in folder.iterdir()}
    project = (ROOT / "pyproject.toml").read_text()
    assert '"zenocap.services.animator.page" = ["static/*"]' in project
    assert '"zenocap.common.web" = ["static/*"]' in project


def test_scene_points_are_sent_unchanged_and_damaged_ones_are_not() -> None:
    def sent_points(data: bytes) -> dict[str, dict[str, object]]:
        return decoded(list(changes(AnimatorState(), after(m.ScenePoints(frame=1, captured_ns=NOW, points=data)))))

    sent = sent_points(packed_points(np.array([[1.0, -2.0, 0.5]])))
    assert np.frombuffer(b64decode(str(sent["points"]["data"])), "<i2").tolist() == [1000, -2000, 500]
    assert "points" not in sent_points(b"12345")


def test_the_latest_commands_are_sent_together_oldest_first() -> None:
    before = after(command_result(0, NOW, "demo/slides/first"))
    results = [command_result(1 + k, NOW, "demo/slides/next") for k in range(COMMANDS_SHOWN + 3)]
    sent = decoded(list(changes(before, after(*results, state=before))))["commands"]
    assert sent["live"] is True
    rows = sent["commands"]
    assert isinstance(rows, list)
    assert [row["number"] for row in rows] == list(range(4, COMMANDS_SHOWN + 4))
    assert rows[-1] == {
        "number": COMMANDS_SHOWN + 3, "captured_ms": pytest.approx(NOW / 1e6 - 20), "posture": "raise-right-arm",
        "action": "zenoh", "target": "demo/slides/next", "confidence": 0.4, "latency_ms": 20.0, "since_end_ms": 320.0,
        "since_start_ms": 2320.0, "outcome": "done",
    }  # fmt: skip


def test_a_page_that_opens_gets_earlier_commands_as_such() -> None:
    """Also an empty list, so that the first command afterwards is known to be new."""
    assert decoded(list(changes(AnimatorState(), after(command_result(0, NOW, "a")))))["commands"]["live"] is False
    none = decoded(list(changes(AnimatorState(), full())))["commands"]
    assert (none["commands"], none["live"]) == ([], False)
    assert "commands" not in decoded(list(changes(full(), full())))


def test_frames_skipped_under_overload_are_losses_beside_the_dropped_ones() -> None:
    sent = services_of(health("viewer", "1", NOW, frames=60, dropped_frames=4, skipped_frames=36, kept_percent=67))
    row = next(row for row in sent["services"] if (row["name"], row["id"]) == ("viewer", "1"))
    assert row["losses"] == [["camera frames dropped", 4, 100], ["camera frames skipped under overload", 36, 100]]


def test_the_page_gets_what_is_left_out_under_overload() -> None:
    rate = m.FrameRate(
        frame=0, captured_ns=1, keep=1, of=2, from_ns=1, phase_ns=0, fps=30.0, limit="viewers", viewers=["1"]
    )  # fmt: skip
    state = after(rate, m.TrackerDetail(frame=0, captured_ns=1, share=0.5))
    reduced = services_of(state=state)["reduced"]
    assert reduced == "reduced to 15 of 30 frames/s: processor of viewer 1; tracker with 50% of its points"
    full = m.FrameRate(frame=1, captured_ns=2, keep=1, of=1, from_ns=2, phase_ns=0, fps=30.0)
    assert services_of(state=after(full))["reduced"] == ""


def test_failed_and_dropped_commands_are_losses_of_the_recognizer() -> None:
    rows = services_of(health("recognizer", "main", NOW, commands_done=9, commands_failed=2, commands_dropped=1))[
        "services"
    ]
    (row,) = (row for row in rows if row["name"] == "recognizer")
    assert row["losses"] == [["commands failed", 2, 0], ["commands dropped", 1, 0]]


def test_the_page_explains_every_loss() -> None:
    """The texts of the table of losses are the keys of the explanations in `side_panel.js`."""
    texts = {one.text for one in LOSSES if one.text}
    script = (ROOT / "services" / "animator" / "page" / "static" / "side_panel.js").read_text(encoding="utf-8")
    assert all(f"'{text}': '" in script for text in texts)


def test_pages_know_whether_the_live_rig_records() -> None:
    found = json.loads(recording_update(heard(health("integrator", "main", NOW, log_messages=12, log_on=1))).data)
    assert found == {"type": "recording", "recording": True, "log": 12}
